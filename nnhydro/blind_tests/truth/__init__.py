"""The tank of `nnhydro conceal`: an own simulator with hidden causes. Flat; numpy and scipy only; imports nothing of the rest."""
