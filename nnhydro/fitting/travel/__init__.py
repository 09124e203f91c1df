"""Coefficient curves over the distance travelled, and their travel scale."""
