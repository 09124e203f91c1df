"""The probabilistic model: marginal likelihood, priors, the unknown law."""
