"""Derivatives of a model's torques with respect to its inputs: matrices and sweeps."""
