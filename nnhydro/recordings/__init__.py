"""What was measured: arm, recordings and campaign as data, their readers and checks, filtering, splitting. NumPy only."""
