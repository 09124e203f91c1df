"""Models for controllers and other programs: one step in time as C99, CasADi, machine code or ONNX, and files such as MuJoCo and URDF."""
