"""What might be missing from a simulation: the card, the columns and the catalogue of hypotheses."""
