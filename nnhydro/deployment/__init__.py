"""Models for controllers and simulators without Python: one step in time with its state, as C99, machine code or ONNX."""
