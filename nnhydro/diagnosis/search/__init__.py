"""Which sets of effects explain the recordings best: stepwise search, refinement, windows of activity."""
