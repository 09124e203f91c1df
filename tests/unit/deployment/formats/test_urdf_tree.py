"""A URDF's tree that is no serial planar arm is refused."""

import numpy as np
import pytest
from robots import ALIGNED, written

from nnhydro.deployment.formats.urdf import read_urdf
from nnhydro.deployment.formats.urdf_tree import read_chain
from nnhydro.errors import ArmError


@pytest.mark.parametrize(("change", "line"), [
    (("robot", "mujoco"), "outermost element is"),
    (('<link name="base"/>', '<link name="base"/><link name="other"/>'), "2 root links"),
    (("</robot>", ""), "not valid XML"), (("<robot name=\"two link\">", "<!DOCTYPE x [<!ENTITY a 'b'>]><robot>"), "declares entities"),
    (('<cylinder radius="0.03" length="0.4"/>', '<box size="1 1 1"/>'), "diameter is unknown"),
    (('<axis xyz="0 0 1"/><limit', '<axis xyz="0 1 0"/><limit'), "turns about another axis"),
    (('<mass value="1.1"/>', '<mass value="heavy"/>'), "'heavy' is not 1 finite"),
    (('<mass value="1.1"/>', '<mass value="0"/>'), "has no mass"),
    (('<parent link="upper"/>', ""), "no parent or child"), (('<child link="fore"/>', '<child link="gone"/>'), "2 root links"),
    (('type="fixed"', 'type="revolute"'), "turns about another axis"), (("revolute", "prismatic"), "no revolute joint"),
    (('<parent link="upper"/><child link="fore"/>', '<parent link="base"/><child link="fore"/>'), "side by side"),
])
def test_a_urdf_that_is_no_planar_arm_is_refused_with_what_mends_it(tmp_path, change, line):
    text = ALIGNED.format(way=1)
    assert change[0] in text
    with pytest.raises(ArmError, match=line) as error:
        read_urdf(written(tmp_path, text.replace(*change)))
    assert "\n" not in str(error.value)


def test_what_is_fixed_to_a_link_moves_with_it(tmp_path):
    name, chain = read_chain(written(tmp_path, ALIGNED.format(way=1)))
    assert name == "two link"
    assert chain.names == ["shoulder", "elbow"]
    upper, fore = chain.bodies
    assert (upper.mass, fore.mass) == (pytest.approx(1.1), pytest.approx(1.1))
    centre = (0.8 * 0.2 + 0.3 * 0.42) / 1.1
    reach = fore.moment / fore.mass - fore.start.p
    assert float(np.linalg.norm(reach)) == pytest.approx(centre)
    np.testing.assert_allclose(chain.axes[0], [0.0, -np.sin(0.4), np.cos(0.4)], atol=1e-12)
    np.testing.assert_allclose(chain.axes[1], chain.axes[0], atol=1e-12)
    assert (upper.radii, fore.radii) == ([0.035], [0.03])


def test_a_link_that_hangs_on_itself_is_a_loop(tmp_path):
    loop = ('<joint name="back" type="fixed"><parent link="fore"/><child link="fore"/></joint>', "</robot>")
    with pytest.raises(ArmError, match="part of a loop"):
        read_chain(written(tmp_path, ALIGNED.format(way=1).replace("</robot>", "".join(loop))))


def test_a_joint_that_slides_is_left_out_and_said(tmp_path):
    text = ALIGNED.format(way=1).replace('type="fixed"', 'type="prismatic"')
    _, chain = read_chain(written(tmp_path, text))
    assert chain.bodies[-1].mass == pytest.approx(0.8)
    assert any("'flange' is prismatic" in note for note in chain.notes)
