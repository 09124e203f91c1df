"""The one place where a claim is decided: what chance alone would gain, and the errors on held-out recordings."""
