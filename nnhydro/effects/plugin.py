"""Effects in a Python file of the user: the file is run, and what its effects return is checked. A fault is reported with its line."""

import importlib.util
import sys
from collections.abc import Callable
from functools import wraps
from hashlib import sha256
from pathlib import Path
from types import FunctionType
from typing import Any

from torch import Tensor

from nnhydro.effects.catalogue import catalogue
from nnhydro.effects.effect import REGISTER, Effect
from nnhydro.errors import ConfigError, NnhydroError, require
from nnhydro.runtime.user_code import fault, register_user_file

ANSWERS = {"columns": "(rows, joints, linear parameters)", "tangent": "(rows, joints, linear parameters)", "apply": "(rows, joints)"}


def load_plugin(path: Path) -> tuple[str, ...]:
    """Run the Python file `path` and return the ids of the effects it adds; raises ConfigError where it has none or fails."""
    require(path.is_file(), f"--effects {path}: is not a file: give a Python file that declares effects with @effect")
    catalogue()
    name = f"nnhydro_plugin_{sha256(str(path.resolve()).encode()).hexdigest()[:12]}"
    before = {id_: cls for id_, cls in REGISTER.items() if cls.__module__ != name}
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    require(spec is not None and spec.loader is not None, f"--effects {path}: is not a Python file (.py)")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    register_user_file(path)
    try:
        spec.loader.exec_module(module)
    except NnhydroError as cause:
        raise ConfigError(f"--effects {path}: {cause}") from cause
    except Exception as cause:
        raise ConfigError(fault(cause)) from cause
    added = tuple(id_ for id_ in REGISTER if id_ not in before)
    require(bool(added), f"--effects {path}: declares no effect: put @effect before a class (nnhydro effects coulomb_friction shows one)")
    for id_ in added:
        _check_answers(REGISTER[id_], path)
    return added


def _check_answers(cls: type[Effect], path: Path) -> None:
    """Have the methods of `cls` that its file writes say where they return a tensor of another shape than a fit needs."""
    for name in ANSWERS.keys() & vars(cls).keys():
        if isinstance(method := vars(cls)[name], FunctionType):
            setattr(cls, name, _require_shape(method, path))


def _require_shape(method: FunctionType, path: Path) -> Callable[[Any, Any], Tensor]:
    """The method, whose answer is checked."""

    @wraps(method)
    def answer(self: Effect, seen: Any) -> Tensor:
        """Return what the method returns; raises ConfigError where that is no tensor of the right shape."""
        found, flow = method(self, seen), getattr(seen, "flow", seen)
        wanted = (*flow.motion.q.shape, *([] if method.__name__ == "apply" else [len(self.linear_names())]))
        if not isinstance(found, Tensor) or tuple(found.shape) != wanted:
            got = f"of shape {tuple(found.shape)}" if isinstance(found, Tensor) else f"a {type(found).__name__}"
            raise ConfigError(f"--effects {path}: line {method.__code__.co_firstlineno}, in {method.__name__}: the answer is {got}; it "
                              f"must be a tensor of shape {wanted}, {ANSWERS[method.__name__]}: at_joint(load, self.joint, "
                              "flow.arm.n_links) makes one of a load (rows, parameters)")
        return found

    return answer
