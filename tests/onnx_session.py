"""An ONNX file or model as onnxruntime runs it."""

import onnxruntime


def session(path_or_bytes):
    """The session, on one thread."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(path_or_bytes, options, providers=["CPUExecutionProvider"])
