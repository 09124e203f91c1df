"""What a recording holds, whatever it is called and however it was saved."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import columns_of, planted, recording, steady_table, write_folder
from rigs import arm

from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.content_hash import content_sha256, marks, steady_sha256

A = arm(1)


def runs(numbers, prefix="run"):
    return [recording(A, planted(A), f"{prefix}{k}", seed=k, seconds=2.0, rate=50.0, noise=0.02) for k in numbers]


def test_the_content_knows_nothing_of_name_filter_and_derived_rates():
    (r,) = runs([1])
    assert content_sha256(replace(r, name="other", qd=None, qdd=None)) == content_sha256(r)


@pytest.mark.parametrize("channel", ["t", "q", "tau"])
def test_the_content_changes_with_one_sample_of_any_channel(channel):
    (r,) = runs([1])
    x = getattr(r, channel).copy()
    x.flat[-1] += 1e-9
    assert content_sha256(replace(r, **{channel: x})) != content_sha256(r)


def test_a_file_that_was_renamed_or_written_in_another_format_is_known(tmp_path):
    import pandas as pd

    folder = write_folder(Campaign.of(A, runs([1, 2])), tmp_path / "c")
    before = {open_campaign(folder).content(name) for name in ("run1", "run2")}
    (folder / "recordings" / "run1.csv").rename(folder / "recordings" / "z.csv")
    r = open_campaign(folder).load("run2")
    frame = pd.DataFrame(columns_of(r))
    (folder / "recordings" / "run2.csv").unlink()
    frame.to_parquet(folder / "recordings" / "again.parquet")
    whole = open_campaign(folder)
    assert {whole.content(name) for name in whole.names} == before


def test_a_table_with_one_steady_run_more_is_known_but_for_that_run():
    table = steady_table(A, planted(A), rows=6)
    assert set(steady_sha256(table.rows(np.arange(6) < 5))) == set(steady_sha256(table)[:5])


RESAVED = {"single precision": lambda x: x.astype(np.float32).astype(float), "six significant digits": lambda x: np.array(
    [float(f"{v:.6g}") for v in x.ravel()]).reshape(x.shape), "five decimals": lambda x: np.round(x, 5)}


@pytest.mark.parametrize("how", RESAVED)
def test_a_file_that_was_saved_again_with_fewer_digits_is_known(how):
    change, missed = RESAVED[how], 0
    for r in runs(range(1, 41)):
        again = replace(r, name="again", t=np.round(r.t, 5), q=change(r.q), tau=change(r.tau))
        assert content_sha256(again) != content_sha256(r)
        missed += not marks(again) & marks(r)
    assert missed == 0


def test_repeats_of_a_motion_are_no_copies_of_each_other():
    (r,) = runs([1])
    rms = float(np.sqrt((r.tau**2).mean()))
    for noise in (0.003, 0.01, 0.1):
        again = [replace(r, tau=r.tau + noise * rms * np.random.default_rng(k).standard_normal(r.tau.shape)) for k in range(20)]
        assert not any(marks(unit) & marks(other) for k, unit in enumerate(again) for other in again[:k])
    assert not marks(r) & marks(replace(r, tau=None))
