"""Motions of a recipe: one kind a file."""
