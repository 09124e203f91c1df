"""Linear regression on sufficient statistics: priors, bounds, penalties, variable projection."""
