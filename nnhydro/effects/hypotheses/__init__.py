"""What a simulation may leave out: one hypothesis a file, which is its whole registration."""
