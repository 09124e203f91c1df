"""Models as ONNX: one step in time with its state."""
