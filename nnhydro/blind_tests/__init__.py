"""Campaigns with a hidden effect, sealed answers, and the score of a diagnosis."""
