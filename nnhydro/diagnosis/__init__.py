"""What is missing: one probabilistic model of baseline, effects, an unknown law and noise; docs/diagnosis.md is the method."""
