"""The one place where a claim is decided, and the errors on held-out recordings."""
