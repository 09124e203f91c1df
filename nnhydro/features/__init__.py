"""What the networks see: one set of inputs a file, each feature odd or even under the mirror image of the rig."""
