"""Reproduction of McLain & Rock (1998): arm, motions, comparison of models, tables."""
