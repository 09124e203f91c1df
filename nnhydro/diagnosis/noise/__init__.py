"""The noise model: a spectrum a joint, a scale a recording."""
