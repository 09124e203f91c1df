"""What a simulation may omit: one hypothesis a file, which is its whole registration."""
