"""A step in time as a graph: the trace of a model that ONNX, C and CasADi are written from."""
