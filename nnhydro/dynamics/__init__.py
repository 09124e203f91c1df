"""A model as the dynamics of an arm: torque from motion, motion from torque, step by step with memory, and the load on its base."""
