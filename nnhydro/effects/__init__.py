"""What might be left out of a simulation: one hypothesis a file; `nnhydro.effects.catalogue` finds them all."""
