"""Fits: sufficient statistics, least squares, priors, travel scale, training of networks and hybrids."""
