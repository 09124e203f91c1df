"""What nnhydro makes of the golden files' inputs, next to the numbers they pin: one function a file."""

import json
from collections.abc import Callable, Iterator
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import torch

from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.axial_added_mass import AxialAddedMass
from nnhydro.physics.loads.axial_drag import AxialDrag
from nnhydro.physics.loads.bearing_friction import bearing_torque, petroff_torque
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.loaded_bearing import load_torque
from nnhydro.physics.loads.normal_drag import NormalDrag, signed_square_integrals
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.seal_friction import seal_torque
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.strips import Strips
from nnhydro.physics.transmission import sensor_torque, to_drives
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.low_pass import LowPass

FOLDER = Path(__file__).resolve().parent.parent / "golden"
Pinned = tuple[str, Any, Any]  # what, nnhydro's value, the golden value
BELT = {"kind": "remote"}
HARD = 1e-12  # rad/s: a sign as sharp as the golden file's sgn()


def golden(file: str) -> Any:
    """Return the document of tests/golden/`file`.json."""
    return json.loads((FOLDER / f"{file}.json").read_text())


def arm_of(p: dict[str, Any], rigid: dict[str, Any] | None = None, **keys: Any) -> Arm:
    """Return the arm with the golden file's parameters `p` (L1, L2, D1, D2, rho); `rigid` gives its masses."""
    r = rigid or {}
    links = [{"length_m": p[f"L{i}"], "diameter_m": p.get(f"D{i}", 0.05), "mass_kg": r.get(f"m{i}", 0.0), "com_m": r.get(f"Lc{i}", 0.0),
              "inertia_kg_m2": r[f"m{i}"] / 48 * (3 * (r[f"D{i}"] ** 2 + r.get(f"d{i}", 0.0) ** 2) + 4 * r[f"L{i}"] ** 2) if r else 0.0}
             for i in (1, 2)]
    return Arm.model_validate({"fluid": {"density_kg_m3": p.get("rho", 1000.0)}, "links": links, **keys})


def flow_of(arm: Arm, states: list[dict[str, float]]) -> Flow:
    """Return the flow of golden `states`, one per row."""
    def pair(stem: str) -> list[list[float]]:
        return [[s[f"{stem}1"], s[f"{stem}2"]] for s in states]

    return Flow(arm, Motion.at(pair("theta"), pair("dtheta"), pair("ddtheta"), [s["u0"] for s in states], [s["du0"] for s in states]))


def cases_of(document: Any) -> list[Any]:
    """Return random and edge cases."""
    return [*document["random_cases"], *document["edge_cases"]]


def kinematics() -> Iterator[Pinned]:
    """A.3, A.4: velocities, accelerations and what they say of the acceleration vector of the link's end."""
    document = golden("kinematics")
    cases = cases_of(document)
    flow = flow_of(arm_of(document["parameters"]), [c["state"] for c in cases])
    A, B, M, N, u_x, du_x, L = flow.A, flow.B, flow.M, flow.N, flow.u_x, flow.du_x, flow.L
    e = torch.stack([torch.cos(flow.phi), torch.sin(flow.phi)], dim=-1)
    n = torch.stack([-torch.sin(flow.phi), torch.cos(flow.phi)], dim=-1)
    end_velocity = (A * L + B)[..., None] * n + u_x[..., None] * e
    end_acceleration = (M * L + N + A * u_x)[..., None] * n + (du_x - A * (A * L + B))[..., None] * e
    ours = {"A": A, "B": B, "M": M, "N": N, "u_x": u_x, "du_x_dt": du_x, "u_y_at_L": A * L + B, "du_y_dt_at_L": M * L + N,
            "inertial_normal_acc_slope": M, "inertial_normal_acc_at_0": N + A * u_x,
            "inertial_axial_acc_slope": -A**2, "inertial_axial_acc_at_0": du_x - A * B,
            "elbow_or_tip_velocity_XY": end_velocity, "elbow_or_tip_acc_XY": end_acceleration}
    for key, value in ours.items():
        yield key, value, [[link[key] for link in c["links"]] for c in cases]


def three_link() -> Iterator[Pinned]:
    """Index ranges of the n-link sums."""
    document = golden("three_link")
    p, cases = document["parameters"], document["cases"]
    links = [{"length_m": L, "diameter_m": D, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 0.0}
             for L, D in zip(p["L"], p["D"], strict=True)]
    arm = Arm.model_validate({"fluid": {"density_kg_m3": p["rho"]}, "links": links})
    flow = Flow(arm, Motion.at(*([c[k] for c in cases] for k in ("theta", "dtheta", "ddtheta", "u0", "du0"))))
    for key, value in {"A": flow.A, "B": flow.B, "M": flow.M, "N": flow.N, "u_x": flow.u_x, "du_x_dt": flow.du_x}.items():
        yield key, value, [[link[key] for link in c["links"]] for c in cases]
    torque = p["C_Dy"] * NormalDrag((1.0,) * 3).columns(flow) + p["C_Dx"] * AxialDrag((1.0,) * 3).columns(flow)
    for i in range(3):
        yield f"drag torque of link {i + 1}", torque[:, :i + 1, i], [c["links"][i]["drag_torque_on_joint"] for c in cases]
        assert not torque[:, i + 1:, i].any()


def drag() -> Iterator[Pinned]:
    """A.5 to A.7, A.12."""
    document = golden("drag")
    p, cases = document["parameters"], cases_of(document)
    arm = arm_of(p)
    flow = flow_of(arm, [c["state"] for c in cases])
    normal, axial = NormalDrag((p["C_Dy1"], p["C_Dy2"])), AxialDrag((p["C_Dx1"], p["C_Dx2"]))
    C_D, C_Dx = tensor(normal.C_D), tensor(axial.C_Dx)
    force, moment = normal.loads(flow)
    for key, value in {"f_y_total": force * C_D, "moment_about_own_joint": moment * C_D, "f_x_total": axial.loads(flow) * C_Dx}.items():
        yield key, value, [[link[key] for link in c["links"]] for c in cases]
    for i in range(2):
        for j in range(i + 1):
            for part, columns in (("normal", normal.columns(flow) * C_D), ("axial", axial.columns(flow) * C_Dx)):
                yield f"{part} torque of link {i + 1}", columns[:, j, i], \
                    [c["links"][i]["torque"][f"on_joint_{j + 1}"][f"from_{part}"] for c in cases]
    total = normal.torque(flow) + axial.torque(flow)
    for key, value in {"tau_joint": total, "tau_joint_normal_part": normal.torque(flow), "tau_joint_axial_part": axial.torque(flow),
                       "base_motor_torque_belt_1to1": to_drives(total, arm_of(p, drive=BELT))}.items():
        yield key, value, [c[key] for c in cases]
    lumped = Strips.of(flow, per_link=1)
    at_midspan = lumped.force_moment(0.5 * flow.rho * (flow.D * C_D)[:, None] * lumped.w.abs() * lumped.w)[0]
    yield "midspan_baseline_f_y", at_midspan, [c["midspan_baseline_f_y"] for c in cases]
    yield from _pieces(flow, normal, cases)


def _pieces(flow: Flow, drag_term: NormalDrag, cases: list[Any]) -> Iterator[Pinned]:
    """The sign-definite pieces of the drag load: each has its own force and centroid."""
    for row, case in enumerate(cases):
        for i, link in enumerate(case["links"]):
            for piece in link["pieces"]:
                A, B = flow.A[row:row + 1, i:i + 1], flow.B[row:row + 1, i:i + 1]
                f, m = signed_square_integrals(A, A * piece["from"] + B, tensor([piece["to"] - piece["from"]]))
                k = 0.5 * flow.rho * flow.D[i] * drag_term.C_D[i]
                yield "force of a piece", k * f, [[piece["f_y"]]]
                if piece["e_y"] is not None:
                    yield "moment of a piece", k * (m + piece["from"] * f), [[piece["f_y"] * piece["e_y"]]]


def inertia() -> Iterator[Pinned]:
    """A.8 in three readings."""
    document = golden("inertia")
    p, cases = document["parameters"], cases_of(document)
    flow = flow_of(arm_of(p), [c["state"] for c in cases])
    for reading, key in (("document", "document"), ("inertial", "inertial_acceleration"), ("energy", "fluid_energy")):
        normal = AddedMass((p["C_My1"], p["C_My2"]), reading=reading)
        axial = AxialAddedMass((p["C_Mx1"], p["C_Mx2"]), reading=reading)
        total = normal.torque(flow) + axial.torque(flow)
        yield f"{reading}: tau_joint", total, [c[key]["tau_joint"] for c in cases]
        if reading == "energy":
            continue
        yield f"{reading}: belt", to_drives(total, arm_of(p, drive=BELT)), [c[key]["base_motor_torque_belt_1to1"] for c in cases]
        C_M, C_Mx = tensor(normal.C_M), tensor(axial.C_Mx)
        force, moment = normal.loads(flow)
        for name, value in {"f_y": force * C_M, "moment_about_own_joint": moment * C_M, "f_x": axial.loads(flow) * C_Mx}.items():
            yield f"{reading}: {name}", value, [[link[name] for link in c[key]["links"]] for c in cases]
        columns = normal.columns(flow) * C_M + axial.columns(flow) * C_Mx
        for j, i in ((0, 0), (0, 1), (1, 1)):
            yield f"{reading}: torque of link {i + 1}", columns[:, j, i], \
                [c[key]["links"][i]["torque"][f"on_joint_{j + 1}"] for c in cases]


def rigid_body() -> Iterator[Pinned]:
    """A.11, A.12; two independent rigid-body programs included."""
    document = golden("rigid_body")
    p, cases = document["parameters"], cases_of(document)
    arm = arm_of(p, p)
    body, states = RigidBody.of_arm(arm), [c["state"] for c in cases]
    for i in (1, 2):
        yield f"inertia of link {i}", arm.links[i - 1].inertia_kg_m2, document["derived"][f"I{i}_centroid_transverse"]

    def torque(**changes: float) -> torch.Tensor:
        return body.torque(flow_of(arm, [{**s, **changes} for s in states]))

    still = {"dtheta1": 0.0, "dtheta2": 0.0, "ddtheta1": 0.0, "ddtheta2": 0.0, "du0": 0.0}
    H = torch.stack([torque(**{**still, "ddtheta1": 1.0}), torque(**{**still, "ddtheta2": 1.0})], dim=-1)
    carriage = body.torque(flow_of(arm, [{**s, **still, "du0": s["du0"]} for s in states]))
    ours = {"H": H, "coriolis_centrifugal": torque(ddtheta1=0.0, ddtheta2=0.0, du0=0.0), "carriage_acceleration_term": carriage,
            "tau_joint": torque(), "tau_joint_without_carriage_acceleration": torque(du0=0.0),
            "base_motor_torque_belt_1to1": to_drives(torque(), arm_of(p, p, drive=BELT)),
            "pinocchio_tau": torque(), "mujoco_tau": torque()}
    for key, value in ours.items():
        yield key, value, [c[key] for c in cases]


def full_chain() -> Iterator[Pinned]:
    """A.12, A.13: all loads through belt, pulley and gear to the sensor."""
    document = golden("full_chain")
    p, cases = document["parameters"], document["cases"]
    d, m, f = p["drag"], p["inertia"], p["friction_magnitudes"]
    flow = flow_of(arm_of(d, p["rigid"]), [c["state"] for c in cases])
    parts = {"rigid": RigidBody.of_arm(flow.arm).torque(flow),
             "hydro": (NormalDrag((d["C_Dy1"], d["C_Dy2"])).torque(flow) + AxialDrag((d["C_Dx1"], d["C_Dx2"])).torque(flow)
                       + AddedMass((m["C_My1"], m["C_My2"])).torque(flow) + AxialAddedMass((m["C_Mx1"], m["C_Mx2"])).torque(flow)),
             "friction": CoulombTerm((f["tau_f1_magnitude"], f["tau_f2_magnitude"]), v0_rad_s=HARD).torque(flow)}
    parts["total"] = parts["rigid"] + parts["hydro"] + parts["friction"]
    belt = arm_of(d, p["rigid"], drive=BELT)
    for name, value in parts.items():
        joint = "hydro_drag_plus_inertia" if name == "hydro" else name
        yield f"{name} at the joints", value, [c["tau_joint"][joint] for c in cases]
        yield f"{name} at the motors", to_drives(value, belt), [c["T_base_1to1"][name] for c in cases]
    wide = arm_of(d, p["rigid"], drive={**BELT, "pulley_ratio": 1.5})
    yield "pulley ratio 1.5", to_drives(parts["hydro"], wide), [c["T_base_hydro_pulley_ratio_1.5"] for c in cases]
    for key, efficiency in (("sensor_torque_lossless", 1.0), ("sensor_torque_with_efficiency", p["gear_efficiency"])):
        gear = {"ratio": p["gear_ratio"], "efficiency": efficiency, "torque_at": "motor"}
        yield key, sensor_torque(parts["total"], flow.motion.qd, arm_of(d, p["rigid"], drive=BELT, gear=gear)), [c[key] for c in cases]


def friction() -> Iterator[Pinned]:
    """A.10."""
    document = golden("friction")
    for c in document["petroff_generic_f0*d^3*(mu*n)^(2/3)"]:
        yield "petroff", petroff_torque(c["f0"], c["d"], c["mu"], tensor(c["n_rpm"])), c["tau"]
    for c in document["order_of_magnitude"]:
        yield "double lip seal", seal_torque(0.5, 80.0, 0.01, 2), c["double_lip_seal_R10mm"]
    for c in document["cases"]:
        i = c["in"]
        n = tensor(i["n_rpm"])
        bearing = bearing_torque(i["f0"], i["d_mm"], i["nu_cSt"], n)
        load = load_torque(i["f1"], i["c"], i["W_N"], i["C0_N"], i["d_mm"] / 1e3)
        seal = seal_torque(i["f_s"], i["R_L_N_per_m"], i["R_s_m"], i["lips"])
        level = float(bearing) + load + seal
        arm = Arm.model_validate({"fluid": {"density_kg_m3": 0.0}, "links": [
            {"length_m": 1.0, "diameter_m": 0.1, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 0.0}]})
        signed = CoulombTerm((level,), v0_rad_s=HARD).torque(Flow(arm, Motion.at([[0.0]], [[i["theta_dot"]]], [[0.0]])))
        yield "bearing", bearing, c["bearing_no_load_two_branch"]
        yield "bearing, power law", 1e-10 * petroff_torque(i["f0"], i["d_mm"], i["nu_cSt"], n), c["bearing_no_load_power_law_only"]
        yield "loaded bearing", load, c["bearing_load"]
        yield "seal", seal, c["lip_seal"]
        yield "sum", level, c["sum_magnitude"]
        yield "signed", signed, [[c["load_torque_signed"]]]


def tow_matrix() -> Iterator[Pinned]:
    """A.13: locked-joint tows over the test grid."""
    document = golden("tow_matrix")
    p, rows = document["parameters"], np.array(document["rows"])
    arm = arm_of(p)
    flow = Flow(arm, Motion.at(rows[:, :2] * pi / 180, 0.0, 0.0, rows[:, 2]))
    tau = NormalDrag((p["C_Dy1"], p["C_Dy2"])).torque(flow) + AxialDrag((p["C_Dx1"], p["C_Dx2"])).torque(flow)
    yield "tau at the joints", tau, rows[:, 3:5]
    yield "T at the motors", to_drives(tau, arm_of(p, drive=BELT)), rows[:, 5:7]


def dimensionless_groups() -> Iterator[Pinned]:
    """A.1: the groups of one link."""
    document = golden("dimensionless_groups")
    p = document["parameters"]
    L, D, nu, rho = p["L"], p["D"], p["nu"], p["rho"]
    arm = Arm.model_validate({"fluid": {"density_kg_m3": rho, "kinematic_viscosity_m2_s": nu}, "links": [
        {"length_m": L, "diameter_m": D, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 0.0}]})
    for c in document["cases"]:
        flow = Flow(arm, Motion.at([[c["theta"]]], [[c["theta_dot"]]], 0.0, c["u0"]))
        tau, u_n, rate = float(NormalDrag((c["C_D"],)).torque(flow)), float(flow.B), float(flow.A)
        ours = {"u_n": lambda u_n=u_n: u_n, "tau": lambda tau=tau: tau, "L_over_D": lambda: L / D,
                "Re_translation=u_n*D/nu": lambda u_n=u_n: u_n * D / nu, "Re_rotation=theta_dot*L^2/nu": lambda rate=rate: rate * L**2 / nu,
                "tau/(rho*D*L^2*u_n^2)": lambda tau=tau, u_n=u_n: tau / (rho * D * L**2 * u_n**2),
                "tau/(rho*D*L^4*theta_dot^2)": lambda tau=tau, rate=rate: tau / (rho * D * L**4 * rate**2),
                "theta_dot*L/u_n": lambda rate=rate, u_n=u_n: rate * L / u_n}
        for key, value in ours.items():
            if key in c:
                yield key, value(), c[key]


def signals() -> Iterator[Pinned]:
    """B.2: the zero-phase low-pass on a quantised encoder."""
    document = golden("signals")
    p = document["parameters"]
    low_pass, dt = LowPass(p["fc"], p["order_per_pass"]), 1 / p["fs"]
    difference = np.diff(document["theta_quantised"]) / dt
    yield "first difference", difference, document["first_difference_at_t_plus_half_sample"]
    filtered = low_pass.apply(np.array(document["first_difference_at_t_plus_half_sample"]), dt)
    yield "velocity_filtered", filtered, document["velocity_filtered"]
    impulse = np.zeros(4001)
    impulse[2000] = 1.0
    response, gain = low_pass.apply(impulse, dt), document["two_pass_gain"]
    measured = [abs(np.exp(-2j * pi * f * dt * np.arange(4001)) @ response) for f in gain["f_Hz"]]
    yield "two_pass_gain", measured, gain["gain"]
    misfit = filtered - np.array(document["velocity_true_at_middle"])
    yield "rms_error_filtered_vs_middle", np.sqrt(np.mean(misfit**2)), document["rms_error_filtered_vs_middle"]


FILES: dict[str, Callable[[], Iterator[Pinned]]] = {f.__name__: f for f in (
    kinematics, three_link, drag, inertia, rigid_body, full_chain, friction, tow_matrix, dimensionless_groups, signals)}
