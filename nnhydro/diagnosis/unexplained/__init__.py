"""What no finding explains: the unknown law, where the residual lies, spectral lines."""
