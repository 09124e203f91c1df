"""A physics model as MuJoCo XML (MJCF), with what MuJoCo can hold of it and a list of what it cannot.

    inertial     mass, mass centre and inertia as identified, a payload at the tip with them
    damping      viscous friction of a joint      frictionloss   Coulomb friction      armature   rotor inertia
    stiffness    hose or cable with its rest angle (springref)
    water        density and fluidcoef of an ellipsoid a link, chosen so that a link that is towed broadside has the identified C_D:
                 blunt = 2 C_D / pi: MuJoCo's force is blunt rho w |w| times the ellipse's area pi L D / 4, ours C_D rho w |w| / 2
                 times L D

MuJoCo's ellipsoids know neither the inertia of the water (added mass acts on rotation rates only, never on accelerations) nor the spread
of speed along a link that turns. Source: MuJoCo documentation, XML reference and "Computation: fluid forces".
"""

import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import pi
from typing import Any, final

from nnhydro.errors import ModelError, require
from nnhydro.models.baselines import physics_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.runtime.files import comment_text


@final
@dataclass(frozen=True)
class MujocoFile:
    """The file's text, what it holds of the model, term by term, and what it cannot hold."""

    xml: str
    holds: tuple[str, ...]
    lacks: tuple[str, ...]


@final
@dataclass
class _Parts:
    """Attributes of the joints and masses of the links as terms fill them in."""

    joints: list[dict[str, float]]
    C_D: list[float]
    payloads: list[tuple[float, float]] = field(default_factory=list)  # mass in kg, distance beyond the last link's end in m
    holds: list[str] = field(default_factory=list)
    lacks: list[str] = field(default_factory=list)

    def add(self, joint: int, key: str, value: float) -> None:
        """Add to an attribute of a joint (from 0)."""
        self.joints[joint][key] = self.joints[joint].get(key, 0.0) + value


def _per_joint(key: str, symbol: str) -> Callable[[_Parts, Any], None]:
    """A term or effect whose values become the attribute `key` of its joints."""
    def fill(parts: _Parts, term: Any) -> None:
        for number, value in enumerate(getattr(term, symbol)):
            parts.add(term.joint - 1 if getattr(term, "joint", 0) else number, key, value)
    return fill


def _friction(parts: _Parts, term: Any) -> None:
    _per_joint("frictionloss", "level")(parts, term)
    if term.bending_rad if isinstance(term, CoulombTerm) else any(term.bending):
        where = "" if isinstance(term, CoulombTerm) else f" at joint {term.joint}"
        parts.lacks.append(f"dry friction{where}: MuJoCo's frictionloss does not bend before it slips")


def _spring(parts: _Parts, term: Any) -> None:
    rest = term.quantities()["rest_angle"].value
    parts.joints[term.joint - 1] |= {"stiffness": term.quantities()["stiffness"].value, "springref": rest}
    if not term.linear:
        parts.lacks.append(f"hose at joint {term.joint}: MuJoCo's spring is linear: held with its stiffness at the rest angle")


def _payload(parts: _Parts, term: Any) -> None:
    parts.payloads.append((term.mass[0], term.beyond[0]))


def _drag(parts: _Parts, term: Any) -> None:
    parts.C_D = list(term.C_D)
    parts.lacks.append("normal_drag: held for a link towed broadside; a turning link has its drag nearer the tip than MuJoCo's ellipsoid")


EXPORTED: dict[str, tuple[str, Callable[[_Parts, Any], None]]] = {
    "viscous_friction": ("joint damping", _per_joint("damping", "coefficient")),
    "effect:viscous_friction": ("joint damping", _per_joint("damping", "coefficient")),
    "coulomb_friction": ("joint frictionloss", _friction),
    "effect:coulomb_friction": ("joint frictionloss", _friction),
    "effect:rotor_inertia": ("joint armature", _per_joint("armature", "inertia")),
    "effect:umbilical_stiffness": ("joint stiffness and springref", _spring),
    "effect:payload_mass": ("mass at the tip of the last link", _payload),
    "normal_drag": ("fluid drag of an ellipsoid a link", _drag),
}
WHY_NOT = {"added_mass": "MuJoCo has no inertia of the water on accelerations", "state_drag": "C_D that depends on the travel",
           "state_added_mass": "C_M that depends on the travel", "state_at_rest": "C_M that depends on the travel",
           "axial_drag": "skin friction along a link"}


def _fill(model: StripTheory) -> _Parts:
    """What of the model MuJoCo's joints and geometries can hold, and what they lack."""
    parts = _Parts([{} for _ in model.arm.links], [0.0] * model.arm.n_links)
    for name, term in model.loads.terms.items():
        if isinstance(term, RigidBody):
            continue
        if term.kind in EXPORTED:
            what, fill = EXPORTED[term.kind]
            fill(parts, term)
            parts.holds.append(f"{name}: {what}")
        else:
            parts.lacks.append(f"{name}: {WHY_NOT.get(term.kind, 'no element of MuJoCo has this law')}")
    parts.lacks += [f"{instrument.id}: a fault of sensors or of the drive, not of the arm" for instrument in model.instruments]
    if model.arm.drive.kind == "remote":
        parts.lacks.append("the belt drive: torques of the file are those at the joints, angles are joint-relative")
    if any(model.arm.gear_of(j).efficiency < 1 for j in range(model.arm.n_links)):
        parts.lacks.append("gear efficiency")
    parts.lacks.append("the carriage: the base stands still; <option wind=\"0 -U 0\"/> tows it at U m/s")
    return parts


def _inertial(body: ET.Element, moments: Sequence[float], D: float, points: Sequence[tuple[float, float]]) -> None:
    """Mass, mass centre and inertia about it; across the link as of a rod of diameter D, which a planar arm never feels.

    `moments` are the link's of order 0, 1 and 2, `points` (mass in kg, distance from its joint in m) what else moves with it.
    """
    mass, first, second = (moment + sum(m * x**order for m, x in points) for order, moment in enumerate(moments))
    require(mass > 0, "a link has no mass: MuJoCo refuses massless bodies that move; state the masses in arm.yaml", ModelError)
    centre = first / mass
    about = second - mass * centre**2
    require(about > 0, f"a link's inertia about its mass centre is {about:.3g} kg m^2: MuJoCo needs a positive one; check its masses",
            ModelError)
    along = min(mass * D**2 / 8, about)
    ET.SubElement(body, "inertial", pos=f"{centre:.9g} 0 0", mass=f"{mass:.9g}", diaginertia=f"{along:.9g} {about:.9g} {about:.9g}")


def _body(parent: ET.Element, model: StripTheory, rigid: RigidBody, parts: _Parts, i: int) -> ET.Element:
    """The body of link `i` (from 0) with inertia, joint and fluid coefficients."""
    arm, last = model.arm, i == model.arm.n_links - 1
    L, D = float(arm.L[i]), float(arm.D[i])
    body = ET.SubElement(parent, "body", name=f"link{i + 1}", pos=f"{float(arm.L[i - 1]):.9g} 0 0" if i else "0 0 0")
    moments = (rigid.mass[i], rigid.first_moment[i], rigid.second_moment[i])
    _inertial(body, moments, D, [(mass, L + beyond) for mass, beyond in parts.payloads] if last else [])
    ET.SubElement(body, "joint", {"name": f"joint{i + 1}", "type": "hinge", "axis": "0 0 1",
                                  **{key: f"{value:.9g}" for key, value in parts.joints[i].items()}})
    fluid = {"fluidshape": "ellipsoid", "fluidcoef": f"{2 * parts.C_D[i] / pi:.9g} 0 0 0 0"} if parts.C_D[i] > 0 else {"fluidshape": "none"}
    ET.SubElement(body, "geom", {"type": "ellipsoid", "pos": f"{L / 2:.9g} 0 0", "size": f"{L / 2:.9g} {D / 2:.9g} {D / 2:.9g}",
                                 "mass": "0", "contype": "0", "conaffinity": "0", **fluid})
    return body


def mujoco_xml(model: TorqueModel) -> MujocoFile:
    """Return `model` as MuJoCo XML; raises ModelError for a learned model and for links without mass.

    World axes are those of conventions.py: joints turn about +Z, weight (where there is any) pulls along -Y.
    """
    model = physics_model(model, "parameters that MuJoCo could hold (--format onnx holds the whole of it)")
    require(not model.arm.sliding, "a linear axis is not written to MuJoCo files: export it as onnx", ModelError)
    rigid = next((term for term in model.loads.terms.values() if isinstance(term, RigidBody)), None)
    require(rigid is not None, "the model has no rigid body: MuJoCo needs masses", ModelError)
    assert rigid is not None
    parts = _fill(model)
    root = ET.Element("mujoco", model=model.arm.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    drag = any(value > 0 for value in parts.C_D)
    ET.SubElement(root, "option", gravity=f"0 {-model.arm.gravity_m_s2:.9g} 0", integrator="implicitfast",
                  density=f"{model.arm.fluid.density_kg_m3 if drag else 0:.9g}")
    place: ET.Element = ET.SubElement(root, "worldbody")
    for i in range(model.arm.n_links):
        place = _body(place, model, rigid, parts, i)
    motors = ET.SubElement(root, "actuator")
    for i in range(model.arm.n_links):
        ET.SubElement(motors, "motor", name=f"drive{i + 1}", joint=f"joint{i + 1}", gear="1")
    ET.indent(root)
    holds = ("rigid_body: mass, mass centre and inertia of every link", *parts.holds)
    said = comment_text("\n".join(["Made by nnhydro from the model " + model.name, "holds", *(f"  {x}" for x in holds), "cannot hold",
                                   *(f"  {x}" for x in parts.lacks)]))
    return MujocoFile(f"<!--\n{said}\n-->\n{ET.tostring(root, encoding='unicode')}\n", holds, tuple(parts.lacks))
