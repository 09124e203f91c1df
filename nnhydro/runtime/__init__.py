"""How work is run: files that appear whole or not at all, one run at a time, workers."""
