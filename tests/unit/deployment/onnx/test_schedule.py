"""When each atom is computed: after what it is made of, in as few rounds as it takes, kinds together."""

import numpy as np

from nnhydro.deployment.onnx.expressions import Program, Scalar, add, combine
from nnhydro.deployment.onnx.schedule import rounds


def random_program(seed, count=60):
    """A program whose atoms stand on those before."""
    rng, p = np.random.default_rng(seed), Program(4)
    values = [p.input(k) for k in range(4)]
    for _ in range(count):
        a, b = (values[k] for k in rng.integers(0, len(values), 2))
        values.append(p.unary(str(rng.choice(["tanh", "sin", "exp"])), combine([(1.0, a), (0.7, b), (1.0, float(rng.normal()))])))
    return p, values[-5:]


def test_every_atom_stands_behind_what_it_is_made_of_and_in_one_round():
    for seed in range(5):
        program, outputs = random_program(seed)
        planned = rounds(program, outputs)
        at = {k: number for number, kinds in enumerate(planned) for atoms in kinds.values() for k in atoms}
        assert sum(len(atoms) for kinds in planned for atoms in kinds.values()) == len(at)
        assert set(at) == {k for k in program.dependencies(outputs) if program.atoms[k].kind != "input"}
        for k, number in at.items():
            sources = {j for x in program.atoms[k].operands if isinstance(x, Scalar) for j in x.terms if j in at}
            assert all(at[j] < number for j in sources)
        assert len(planned) == max(program.atoms[k].level for k in at)


def test_a_kind_that_can_wait_is_computed_with_the_others_of_its_kind():
    """exp of an input could be computed at once; its only reader needs exp of a tanh besides."""
    p = Program(2)
    early = p.unary("exp", p.input(1))
    late = p.unary("exp", p.unary("tanh", p.input(0)))
    planned = rounds(p, [p.mul(early, late), add(early, late)])
    assert [set(kinds) for kinds in planned] == [{"tanh"}, {"exp"}, {"mul"}]
    assert len(planned[1]["exp"]) == 2
