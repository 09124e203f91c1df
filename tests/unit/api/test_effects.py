"""The catalogue explains each effect."""

import nnhydro


def test_the_catalogue_explains_each_effect():
    known = nnhydro.catalogue()
    assert len(known) == len(known.to_frame()) >= 30
    assert set(known) == set(known.to_frame()["id"])
    assert known["coulomb_friction"]["parameters"][0]["unit"] == "N m"
