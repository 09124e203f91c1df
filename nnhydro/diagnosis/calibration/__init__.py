"""What chance alone would gain, and what would be found: null draws, injection, confidence, power."""
