"""What might be missing from a simulation: one hypothesis a file; `nnhydro.effects.catalogue` finds them all."""
