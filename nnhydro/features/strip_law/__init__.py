"""The law of the strips: what a strip remembers and sees, and the loads that are linear in its coefficients."""
