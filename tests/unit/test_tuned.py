"""A wave with a phase of its own in every recording is claimed only where its pitch stands out among the others on its card."""

from types import SimpleNamespace

import numpy as np
import pytest
from races import NOISE, P, Plain, instance, raced, tables

from nnhydro.diagnosis.tuned import drop_untuned, usual

WAVE = SimpleNamespace(spread={}, own_in_every_recording=True)
MANY = 12
PITCHES = [instance("wave", (k,), own=(0,), effect=WAVE) for k in range(MANY)]
OTHER = instance("other", (MANY,))


def shaken(share, seed=1):
    """Tables with a wave of the first pitch and another effect; of every pitch's column `share` is the same shape."""
    rng, made = np.random.default_rng(seed), tables(seed, {MANY: 0.5}, columns=MANY + 1)
    for table in made:
        shape = rng.standard_normal(table.shape[:2])
        table[..., P:P + MANY] = np.sqrt(share) * shape[..., None] + np.sqrt(1 - share) * table[..., P:P + MANY]
        table[..., -1] += 0.9 * np.sign(rng.standard_normal()) * NOISE * table[..., P]
    return made


@pytest.mark.parametrize(("share", "stays"), [(0.0, True), (0.5, True), (0.95, False)])
def test_a_wave_stays_where_its_pitch_gains_much_more_than_most_others_do(share, stays):
    found = raced(table := Plain(shaken(share)), [*PITCHES, OTHER], chosen=(0, MANY))
    wave = found.chosen[0]
    drop_untuned(found, table, None, [*PITCHES, OTHER])
    assert (wave in found.chosen) == stays
    assert [c.key[0] for c in found.chosen if c is not wave] == ["other"]
    assert found.log[0].startswith("wave: gains ")


def test_what_any_wave_gains_is_the_upper_quartile_over_the_card_beside_what_else_is_chosen():
    found = raced(table := Plain(shaken(0.3)), [*PITCHES, OTHER], chosen=(0, MANY))
    gains = [found.total(without=[found.chosen[0]]) - found.total([c], without=[found.chosen[0]]) for c in found.bank.candidates[:MANY]]
    assert usual(found, table, None, found.chosen[0], [*PITCHES, OTHER]) == pytest.approx(np.quantile(gains, 0.75), rel=1e-6)


def test_a_card_of_few_values_tells_nothing_of_other_pitches_and_what_has_no_phase_of_its_own_is_not_asked():
    found = raced(table := Plain(shaken(0.95)), [*PITCHES, OTHER], chosen=(0, MANY))
    assert usual(found, table, None, found.chosen[0], PITCHES[:8]) == 0.0
    found.chosen = found.chosen[1:]
    drop_untuned(found, table, None, PITCHES)
    assert [c.key[0] for c in found.chosen] == ["other"]
    assert found.log == []


def test_of_two_waves_that_do_not_stand_out_the_weaker_goes_first_and_the_other_is_asked_again(monkeypatch):
    waves = [instance(name, (k,), own=(0,), effect=WAVE) for k, name in enumerate(("first", "second"))]
    found = raced(table := Plain(shaken(0.0)), waves, chosen=(0, 1))
    first, second = found.chosen
    gain, asked = {c.key: found.loss(c) for c in found.chosen}, []

    def usual_of(race, *given):
        asked.append(given[2])
        return {first.key: 0.9 * gain[first.key], second.key: gain[first.key]}[given[2].key] if len(race.chosen) > 1 else 0.0

    monkeypatch.setattr("nnhydro.diagnosis.tuned.usual", usual_of)
    drop_untuned(found, table, None, waves)
    assert (found.chosen, asked) == ([first], [first, second, first])
