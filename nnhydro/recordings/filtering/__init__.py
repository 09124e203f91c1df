"""From channels to motions: cut-off, low-pass, derivatives, fused trajectories."""
