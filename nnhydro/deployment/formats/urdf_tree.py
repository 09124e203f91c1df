"""A URDF's tree of links and joints, walked from the root outwards; links that are fixed to each other become one body.

Source of the format: wiki.ros.org/urdf/XML.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import cos, sin
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import ArmError

Array = NDArray[np.float64]
MAX_BYTES = 20_000_000
TURNING, FIXED = ("revolute", "continuous"), "fixed"


def _numbers(text: str | None, default: str, where: str) -> Array:
    """The finite numbers in an attribute, as many as its default has; raises ArmError otherwise."""
    values = (text or default).split()
    try:
        found = np.array([float(value) for value in values])
    except ValueError:
        found = np.array([np.nan])
    if len(found) != len(default.split()) or not np.isfinite(found).all():
        raise ArmError(f"{where}: {text!r} is not {len(default.split())} finite number(s): correct it")
    return found


def _rotation(rpy: Array) -> Array:
    """R_z(yaw) R_y(pitch) R_x(roll)."""
    (cr, sr), (cp, sp), (cy, sy) = ((cos(a), sin(a)) for a in rpy)
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                     [-sp, cp * sr, cp * cr]])


@final
@dataclass(frozen=True)
class Pose:
    """Rotation (3, 3) and position (3,) m of a frame, seen from the root."""

    R: Array = field(default_factory=lambda: np.eye(3))
    p: Array = field(default_factory=lambda: np.zeros(3))

    def then(self, origin: "ET.Element | None", where: str) -> "Pose":
        """Return the frame that `origin` places within this one."""
        get = (lambda key: None) if origin is None else origin.get
        step = _numbers(get("xyz"), "0 0 0", f"{where}: xyz")
        return Pose(self.R @ _rotation(_numbers(get("rpy"), "0 0 0", f"{where}: rpy")), self.p + self.R @ step)


@final
@dataclass(frozen=True)
class _Joint:
    name: str
    kind: str
    child: str
    element: ET.Element


@final
@dataclass
class Body:
    """All links that move with one joint: mass kg, first moment kg m, inertia about the origin kg m^2, cylinders, farthest points."""

    name: str
    start: Pose
    mass: float = 0.0
    moment: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    radii: list[float] = field(default_factory=list)
    points: list[Array] = field(default_factory=list)


def _tree(path: Path) -> ET.Element:
    """The XML tree of a URDF, without entities and below a size limit; raises ArmError otherwise."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ArmError(f"{path}: larger than {MAX_BYTES} bytes: is this a URDF?")
        text = path.read_bytes()
    except OSError as cause:
        raise ArmError(f"{path}: cannot be read ({cause.strerror or cause}): check the path") from cause
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise ArmError(f"{path}: declares entities, which a URDF does not need and which can fill the memory: remove the DOCTYPE")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as cause:
        raise ArmError(f"{path}: is not valid XML: {cause}") from cause
    if root.tag != "robot":
        raise ArmError(f"{path}: the outermost element is <{root.tag}>, a URDF has <robot>: expand xacro first (xacro FILE > FILE.urdf)")
    return root


def _joints(root: ET.Element, path: Path) -> dict[str, list[_Joint]]:
    """Joints by the link that they hang on."""
    found: dict[str, list[_Joint]] = {}
    for element in root.findall("joint"):
        ends = [element.find(tag) for tag in ("parent", "child")]
        name, kind = element.get("name", "?"), element.get("type", "?")
        if any(end is None or not end.get("link") for end in ends):
            raise ArmError(f"{path}: joint {name!r} has no parent or child link: add <parent link=.../> and <child link=.../>")
        parent, child = (str(end.get("link")) for end in ends if end is not None)
        found.setdefault(parent, []).append(_Joint(name, kind, child, element))
    return found


def _cylinders(link: ET.Element, pose: Pose, where: str) -> Iterator[tuple[float, Array, Array]]:
    """(radius, one end, other end) of every cylinder or capsule of a link, collision shapes before visual ones."""
    for tag in ("collision", "visual"):
        for shape in link.findall(tag):
            frame = pose.then(shape.find("origin"), where)
            for cylinder in [*shape.findall("geometry/cylinder"), *shape.findall("geometry/capsule")]:
                radius = float(_numbers(cylinder.get("radius"), "0", f"{where}: radius")[0])
                half = float(_numbers(cylinder.get("length"), "0", f"{where}: length")[0]) / 2
                yield radius, frame.p + half * frame.R[:, 2], frame.p - half * frame.R[:, 2]


def _add(body: Body, link: ET.Element, pose: Pose, where: str) -> None:
    """Add mass, shapes and frame of one link to the body that it moves with."""
    body.points.append(pose.p)
    for radius, start, end in _cylinders(link, pose, where):
        body.radii.append(radius)
        body.points += [start, end]
    inertial = link.find("inertial")
    if inertial is None:
        return
    frame, mass = pose.then(inertial.find("origin"), where), inertial.find("mass")
    m = float(_numbers(None if mass is None else mass.get("value"), "0", f"{where}: mass")[0])
    entries = inertial.find("inertia")
    xx, yy, zz, xy, xz, yz = (float(_numbers(None if entries is None else entries.get(key), "0", f"{where}: {key}")[0])
                              for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    tensor = frame.R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ frame.R.T
    body.mass += m
    body.moment = body.moment + m * frame.p
    body.inertia = body.inertia + tensor + m * (frame.p @ frame.p * np.eye(3) - np.outer(frame.p, frame.p))


@final
@dataclass
class Chain:
    """What walking the tree found: a body a joint, each joint's axis, and everything that no arm.yaml holds."""

    links: dict[str, ET.Element]
    children: dict[str, list[_Joint]]
    path: Path
    bodies: list[Body] = field(default_factory=list)
    axes: list[Array] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    friction: list[dict[str, float]] = field(default_factory=list)  # one a joint, by the keys of arm.yaml
    notes: list[str] = field(default_factory=list)
    ahead: list[tuple[_Joint, Pose]] = field(default_factory=list)  # joints that turn, still to be walked through

    def walk(self, link: str, pose: Pose, body: Body, depth: int = 0) -> None:
        """Add `link` and what is fixed to it to `body`, then go on behind the one joint that turns."""
        where = f"{self.path}: link {link!r}"
        if link not in self.links or depth > len(self.links):
            wrong = "part of a loop" if link in self.links else "not there"
            raise ArmError(f"{where} is {wrong}: a URDF is a tree of its links; correct it")
        _add(body, self.links[link], pose, where)
        for joint in self.children.get(link, []):
            frame = pose.then(joint.element.find("origin"), f"{self.path}: joint {joint.name!r}")
            if joint.kind == FIXED:
                self.walk(joint.child, frame, body, depth + 1)
            elif joint.kind in TURNING:
                self.ahead.append((joint, frame))
            else:
                self.notes.append(f"joint {joint.name!r} is {joint.kind}: nnhydro knows revolute joints; what hangs on it is left out")

    def follow(self, root: str) -> None:
        """Walk from `root` to the tip; raises ArmError where the joints that turn branch."""
        self.walk(root, Pose(), Body(root, Pose()))
        while self.ahead:
            if len(self.ahead) > 1:
                names = ", ".join(repr(joint.name) for joint, _ in self.ahead)
                raise ArmError(f"{self.path}: the joints {names} turn side by side: nnhydro knows serial arms; remove the other branch")
            joint, frame = self.ahead.pop()
            axis = joint.element.find("axis")
            direction = frame.R @ _numbers(None if axis is None else axis.get("xyz"), "1 0 0", f"{self.path}: joint {joint.name!r}: axis")
            self.axes.append(direction / (np.linalg.norm(direction) or 1.0))
            self.names.append(joint.name)
            self.friction.append(self._friction_of(joint))
            body = Body(joint.child, frame)
            self.bodies.append(body)
            self.walk(joint.child, frame, body)

    def _friction_of(self, joint: _Joint) -> dict[str, float]:
        """Friction of a joint as arm.yaml names it, what is 0 left out; a note says that it was taken."""
        tag = joint.element.find("dynamics")
        if tag is None:
            return {}
        read = {key: float(_numbers(tag.get(name), "0", f"{self.path}: joint {joint.name!r}: {name}")[0])
                for key, name in (("coulomb_Nm", "friction"), ("viscous_Nm_s", "damping"))}
        found = {key: value for key, value in read.items() if value}
        if found:
            stated = ", ".join(f"{key} {value:g}" for key, value in found.items())
            self.notes.append(f"joint {joint.name!r} states friction, taken as {stated}, known to 10 %: remove it from arm.yaml if it is a "
                              "guess or a simulator's default; identify or diagnose finds it from recordings")
        return found


def read_chain(path: Path) -> tuple[str, Chain]:
    """Return the robot's name and its chain of joints that turn; raises ArmError where the file is no URDF or is not one serial chain."""
    root = _tree(path)
    links = {str(link.get("name")): link for link in root.findall("link")}
    children = _joints(root, path)
    below = {joint.child for joints in children.values() for joint in joints}
    tops = [name for name in links if name not in below]
    if len(tops) != 1:
        raise ArmError(f"{path}: has {len(tops)} root links ({', '.join(tops[:5])}): a URDF has one; correct the parents of its joints")
    chain = Chain(links, children, path)
    chain.follow(tops[0])
    if not chain.bodies:
        raise ArmError(f"{path}: has no revolute joint: nnhydro knows arms of revolute joints; is this the right file?")
    return root.get("name", path.stem), chain
