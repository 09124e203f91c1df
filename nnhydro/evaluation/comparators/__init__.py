"""General-purpose regressions for comparison: one method a file."""
