"""Files of other programs: URDF in, MuJoCo XML and coefficient curves out. What a file cannot hold is said, never dropped in silence."""
