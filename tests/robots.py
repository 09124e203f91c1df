"""A robot as a URDF, and how MuJoCo moves one."""

import numpy as np
import pytest

ROBOT = """<robot name="two link">
  <link name="base"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0.3 0.1 0.2" rpy="0.4 0 0"/><axis xyz="0 0 1"/><limit effort="1" velocity="1"/></joint>
  <link name="upper">
    <inertial><origin xyz="0.2 0 0.01" rpy="0.3 0.2 0.1"/><mass value="1.1"/>
      <inertia ixx="0.010" iyy="0.03" izz="0.028" ixy="0.001" ixz="0" iyz="0.0005"/></inertial>
    <collision><origin xyz="0.25 0 0" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.035" length="0.5"/></geometry></collision>
  </link>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.55 0 0.08" rpy="0 0 0.7"/><axis xyz="0 0 {way}"/><dynamics damping="0.1" friction="0.2"/></joint>
  <link name="fore">
    <inertial><origin xyz="0.2 0 0"/><mass value="0.8"/><inertia ixx="0.001" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.03" length="0.4"/></geometry></collision>
  </link>
  <joint name="flange" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="0.4 0 0" rpy="0 0 0.5"/></joint>
  <link name="hand">
    <inertial><origin xyz="0.02 0 0"/><mass value="0.3"/><inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
</robot>
"""
ALIGNED = ROBOT.replace('rpy="0 0 0.5"', 'rpy="0 0 0"')  # with the hand in line, the arm is exactly planar: no mass lies beside a link


def written(tmp_path, text):
    """The text as a file."""
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    return path


def inverse(model, q, qd, qdd):
    """MuJoCo's joint torques (n, joints) at unrelated states."""
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed: pip install 'nnhydro[test]'")
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data, found = mujoco.MjData(model), []
    for row in zip(q, qd, qdd, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = row
        mujoco.mj_inverse(model, data)
        found.append(data.qfrc_inverse.copy())
    return np.array(found)


def compiled(xml):
    """The text as MuJoCo reads it."""
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed: pip install 'nnhydro[test]'")
    return mujoco.MjModel.from_xml_string(xml)


def random_states(links, rows=40, seed=3):
    """Angles, rates and accelerations of unrelated states; no joint stands still."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-3, 3, (rows, links)), rng.choice([-1, 1], (rows, links)) * rng.uniform(0.5, 2, (rows, links)), \
        4 * rng.standard_normal((rows, links))
