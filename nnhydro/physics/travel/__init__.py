"""Distance travelled by each strip, loads that depend on it, and what the wake remembers."""
