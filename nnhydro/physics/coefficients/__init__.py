"""How drag and added-mass coefficients vary: with travel, Reynolds number, Keulegan-Carpenter number, aspect ratio; one law a file."""
