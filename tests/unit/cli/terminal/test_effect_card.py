"""What `nnhydro effects` prints of the catalogue and of one effect."""

import pytest

from nnhydro.cli.terminal.effect_card import WIDTH, print_card, print_list
from nnhydro.effects.catalogue import catalogue

EFFECTS = catalogue()


def test_the_list_has_a_line_an_effect(capsys):
    print_list([EFFECTS["backlash"], EFFECTS["tip_drag"]])
    text = capsys.readouterr().out
    assert text.startswith("2 effects that a simulation may omit")
    assert "backlash" in text
    assert "tip_drag" in text


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_a_card_says_all_that_is_known_of_its_effect(name, capsys):
    print_card(EFFECTS[name])
    text = " ".join(capsys.readouterr().out.split())
    effect = EFFECTS[name]
    for part in (effect.mechanism, effect.source, effect.signature.region, *effect.signature.mistaken_for, effect.family):
        assert " ".join(part.split()) in text
    assert ("through what the sensors read" in text) == hasattr(effect, "apply")
    assert all(field.name in text for field in effect.parameters())


def test_paragraphs_are_no_wider_than_a_page(capsys):
    print_card(EFFECTS["backlash"])
    text, _, _ = capsys.readouterr().out.partition("Parameters")
    assert max(map(len, text.splitlines())) <= WIDTH
