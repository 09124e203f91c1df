"""Training of networks and hybrids: rows, linear part, gradient fit, stacking, predictive deviation."""
