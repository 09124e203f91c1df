"""What to record next: rig limits, candidate motions, discrimination between equivalent effects."""
