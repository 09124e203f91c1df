"""A URDF as a planar arm: the chain of parallel revolute joints from the root outwards.

    length_i     distance between the axes of joints i and i+1 across them; of the last link the farthest point of its shape, or of a
                 frame that is fixed to it
    com_i        mass centre along the link
    inertia_i    n' (R I R' + m (r'r E - r r')) n about the common mass centre, n the joints' axis
    diameter_i   twice the radius of the link's cylinder

Frame: +Z is the axis of joint 1. In a horizontal plane +X is that of the URDF's root frame, else +Y points up. Friction is that of
<dynamics>.
Angles: URDF counts from its own zero posture, nnhydro from the line of the link inboard; where they differ the notes give the offset and
sign for columns.yaml. The reduction to a plane is ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import degrees
from pathlib import Path
from typing import Any, final

import numpy as np
import yaml

from nnhydro.deployment.formats.urdf_tree import Array, Body, Chain, read_chain
from nnhydro.errors import ArmError, count_text
from nnhydro.recordings.arm import Arm, parse_arm

PARALLEL = 1e-3  # rad between axes that count as parallel
SMALL = 1e-3  # of a link's length: what lies beside its line and is not worth a note
UP, G = np.array([0.0, 0.0, 1.0]), 9.81  # of a URDF's root frame
FLAT = 0.02  # of the weight: a plane that is tilted less counts as horizontal
DENSITY, VISCOSITY = 1000.0, 1e-6


@final
@dataclass(frozen=True)
class ImportedArm:
    """The arm, and what a reader must know: offsets of angles, and what of the file it does not hold."""

    arm: Arm
    notes: tuple[str, ...]


def _across(v: Array, axis: Array) -> Array:
    """The part of v across the axis."""
    return v - (v @ axis) * axis


def _lines(chain: Chain, axis: Array) -> list[Array]:
    """From each joint to the next (or to the tip) across the axis, m; raises ArmError where there is nothing to measure."""
    found = []
    for number, body in enumerate(chain.bodies):
        if number + 1 < len(chain.bodies):
            line = _across(chain.bodies[number + 1].start.p - body.start.p, axis)
        else:
            line = max((_across(point - body.start.p, axis) for point in body.points), key=lambda v: float(np.linalg.norm(v)))
        if np.linalg.norm(line) <= 0:
            raise ArmError(f"{chain.path}: link {body.name!r} has no length: give it a cylinder, or a frame fixed at its tip")
        found.append(line)
    return found


def _angle(a: Array, b: Array, axis: Array) -> float:
    """Angle from a to b about the axis, rad."""
    return float(np.arctan2(np.cross(a, b) @ axis, a @ b))


def _link(chain: Chain, body: Body, line: Array, axis: Array, diameter: float | None) -> dict[str, Any]:
    """One link of arm.yaml from a body of the URDF; raises ArmError where mass, length or diameter is missing."""
    length = float(np.linalg.norm(line))
    e = line / length
    if diameter is None and not body.radii:
        raise ArmError(f"{chain.path}: link {body.name!r} has no cylinder, so its diameter is unknown: add <collision><geometry><cylinder "
                       "radius=... length=.../>, or give --diameter D1,D2 in metres")
    if body.mass <= 0:
        raise ArmError(f"{chain.path}: link {body.name!r} has no mass: add <inertial> with mass, origin and inertia")
    com = body.moment / body.mass - body.start.p
    offset = float(np.linalg.norm(_across(com, axis) - (com @ e) * e))
    if offset > SMALL * length:
        chain.notes.append(f"the mass centre of link {body.name!r} lies {offset:.3g} m beside its line: arm.yaml holds its place along it")
    centre = body.moment / body.mass
    about = body.inertia - body.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return {"length_m": _round(length), "diameter_m": _round(2 * max(body.radii) if diameter is None else diameter),
            "mass_kg": _round(body.mass), "com_m": _round(float(com @ e)), "inertia_kg_m2": _round(max(float(axis @ about @ axis), 0.0))}


def _round(x: float) -> float:
    return float(f"{x:.9g}")


def _frame(axis: Array) -> tuple[Array, float]:
    """+X of arm.yaml as a unit vector of the URDF, and the weight in the plane, m/s^2; +Y points up where there is weight."""
    up = _across(G * UP, axis)
    weight = float(np.linalg.norm(up))
    if weight < FLAT * G:
        x = _across(np.array([1.0, 0.0, 0.0]), axis)
        return x / np.linalg.norm(x), 0.0
    return np.cross(up / weight, axis), weight


def _vector(x: Array) -> str:
    return f"({', '.join(f'{value + 0.0:.3g}' for value in np.round(x, 6))})"


def _frame_notes(chain: Chain, axis: Array) -> Array:
    """Return +X of arm.yaml in the URDF; say where the frame is not the URDF's, and where the arm has weight."""
    x, weight = _frame(axis)
    y = np.cross(axis, x)
    if np.abs(x - np.eye(3)[0]).max() > PARALLEL or np.abs(y - np.eye(3)[1]).max() > PARALLEL:
        chain.notes.append(f"+X, from which q1 counts, is {_vector(x)} in the URDF's root frame; +Y, along which the carriage moves at "
                           f"u0, is {_vector(y)}")
    if weight:
        chain.notes.append(f"the joints' axes are not vertical (gravity along -Z of the URDF): arm.yaml has gravity_m_s2: 0.0, write "
                           f"{weight:.4g} there if the arm is mounted so")
    return x


def _angle_notes(chain: Chain, lines: list[Array], axis: Array, x: Array) -> None:
    """Say where the file's zero angle or sense of turning is not ours; joint 1 counts from `x`."""
    for number, (name, joint_axis) in enumerate(zip(chain.names, chain.axes, strict=True)):
        sign = 1 if joint_axis @ axis > 0 else -1
        offset = _angle(x if number == 0 else lines[number - 1], lines[number], axis)
        if sign < 0 or abs(offset) > PARALLEL:
            entry = f"q{number + 1}_rad: {{from: {name}, unit: deg, sign: {sign}, offset: {degrees(offset):.6g}}}"
            chain.notes.append(f"joint {name!r} counts its angle {'the other way round or ' if sign < 0 else ''}from another zero: where "
                               f"recordings hold the URDF's angle in degrees, write into columns.yaml  {entry}")


def read_urdf(path: Path, diameters: tuple[float, ...] = (), density: float = DENSITY, viscosity: float = VISCOSITY) -> ImportedArm:
    """Return the planar arm in the URDF file `path`; `diameters` [m] replace those of its shapes, the water is fresh by default.

    Raises ArmError with one line where the file is no URDF, branches, has axes that are not parallel or lacks a mass or a diameter.
    """
    name, chain = read_chain(path)
    axis = chain.axes[0]
    for joint, joint_axis in zip(chain.names, chain.axes, strict=True):
        if np.linalg.norm(np.cross(joint_axis, axis)) > PARALLEL:
            raise ArmError(f"{path}: joint {joint!r} turns about another axis than {chain.names[0]!r}: nnhydro knows planar arms, all axes "
                           "parallel; cut the file down to the joints that move in one plane")
    if diameters and len(diameters) != len(chain.bodies):
        raise ArmError(f"--diameter: {len(diameters)} given, {path} has {count_text(len(chain.bodies), 'link')}: give one per link")
    lines = _lines(chain, axis)
    _angle_notes(chain, lines, axis, _frame_notes(chain, axis))
    apart = [abs(float((b.start.p - a.start.p) @ axis)) for a, b in pairwise(chain.bodies)]
    made = [_link(chain, body, line, axis, diameters[i] if diameters else None)
            for i, (body, line) in enumerate(zip(chain.bodies, lines, strict=True))]
    document: dict[str, Any] = {"name": name, "links": made,
                                "fluid": {"density_kg_m3": density, "kinematic_viscosity_m2_s": viscosity}}
    if any(chain.friction):
        document["friction"] = chain.friction
    if len(apart) == 1 and apart[0] > 0:
        document["parallel_distance_m"] = _round(apart[0])
    chain.notes.append("a URDF says nothing of the water and of how well it knows its masses: see fluid and known_to")
    return ImportedArm(parse_arm(document, str(path)), tuple(chain.notes))


def arm_yaml(arm: Arm, remarks: Sequence[str] = ()) -> str:
    """Return the arm as the text of arm.yaml, `remarks` as comments on top."""
    document = arm.document()
    links = document.pop("links")
    head = "".join(f"# {' '.join(remark.split())}\n" for remark in remarks)
    body = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, default_flow_style=None, width=1000)
    rows = "".join(f"  - {yaml.safe_dump(link, sort_keys=False, default_flow_style=True, width=1000).strip()}\n" for link in links)
    return f"{head}{body}links:\n{rows}"
