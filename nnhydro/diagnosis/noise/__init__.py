"""The noise model: one spectrum per joint, one scale per recording."""
