"""The recipe of a campaign: its keys, its loads, its motions, checked whole."""
