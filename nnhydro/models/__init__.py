"""Motion in, torque out: physics, networks and hybrids behind one interface, their storage, predictions and gains."""
