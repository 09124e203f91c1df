"""Data and hypotheses: trajectory, design matrix, baseline, enumeration of effects. No statistics."""
