"""A model leaves the house: one step in time, with all that it remembers, for controllers and simulators that know nothing of Python."""
