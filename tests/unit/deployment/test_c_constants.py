"""ConstantTables of a C program: equal tables once, places as short as they may be, weights of a run once."""

from nnhydro.deployment.c_constants import ConstantTables


def test_equal_tables_are_kept_once_and_places_are_as_short_as_they_may_be():
    constants = ConstantTables(repr, "m_")
    first = constants.table([1.5, 2.0], False)
    assert constants.table([1.5, 2.0], False) == first == "m_r0"
    near, far = constants.table([1, 2], True), constants.table([1, 65536], True)
    assert [constants.kinds[name] for name in (first, near, far)] == ["real", "unsigned short", "int"]
    assert constants.tables[0] == "static const real m_r0[2] = {1.5,2.0};"


def test_weights_are_one_number_one_for_each_run_or_one_for_each_place():
    constants = ConstantTables(repr, "")
    assert constants.weights(0, [2.0] * 6, 3, "3*r + i") == (("real c0", "2.0"), "c0")
    assert constants.weights(1, [2.0] * 3 + [4.0] * 3, 3, "3*r + i") == (("const real *RESTRICT c1", "r0"), "c1[r]")
    assert constants.weights(2, [1.0, 2.0, 3.0, 4.0], 2, "2*r + i") == (("const real *RESTRICT c2", "r1"), "c2[2*r + i]")
    assert constants.weights(3, [1.0, 2.0], 1, "i") == (("const real *RESTRICT c3", "r2"), "c3[i]")
    assert constants.tables[0] == "static const real r0[2] = {2.0,4.0};"
