"""What a campaign can reveal, in words: effects that show at some size, at none, that the baseline absorbs, that look like another."""

from nnhydro.report.effects.power_table import power_sheet, power_verdict


def row(effect, size=0.1, visible=0.5, likeness=0.2, **more):
    """One parameter of one effect."""
    return {"effect": effect, "parameter": "level", "unit": "N m", "joint": 1, "smallest_size": size, "visible_share": visible,
            "lambda": 4.2, "nearest": "torque_bias", "likeness": likeness, "at": {}} | more


def verdict(*rows):
    return power_verdict({"recordings": 3, "effects": list(rows)})


def test_an_effect_counts_once_and_is_revealed_where_one_of_its_parameters_is():
    assert verdict(row("friction"), row("friction", size=None), row("tether")) == "3 recordings can reveal 2 of 2 effects."


def test_what_shows_at_no_size_is_told_apart_from_what_the_baseline_absorbs():
    said = verdict(row("friction"), row("hidden", size=None), row("mass", size=None, visible=1e-4))
    assert said == "3 recordings can reveal 1 of 3 effects; at no size hidden; the fit of the baseline absorbs mass."


def test_an_effect_that_looks_like_another_in_everything_that_shows_is_named():
    assert "cannot distinguish friction from" in verdict(row("friction", likeness=0.9999), row("friction", size=None, likeness=0.1))
    assert "cannot distinguish" not in verdict(row("friction", likeness=0.9999), row("friction", likeness=0.1))


def test_an_empty_size_says_that_nothing_shows():
    sheet = power_sheet({"effects": [row("friction", size=None, nearest=None), row("tether", at={"period": 2.5})]})
    first, second = (dict(zip(sheet.headings(), cells, strict=True)) for cells in sheet.rows())
    assert (first["smallest size"], first["nearest (cosine)"], first["at"]) == ("", "", "")
    assert (second["smallest size"], second["nearest (cosine)"], second["at"]) == ("0.1", "torque_bias (0.20)", "period 2.5")
