"""The score of concealed campaigns on the screen."""

from typing import Any

from nnhydro.cli.terminal.output import conclude, say, table


def _percent(x: float | None) -> str:
    return "" if x is None else f"{100 * x:.0f} %"


def _number(x: float | None) -> str:
    return "" if x is None else f"{x:.3g}"


def print_score(score: dict[str, Any], where: str) -> None:
    """Print groups, totals and the confusion table."""
    table(f"{where}: {score['scored']} diagnoses",
          ("hidden", "campaigns", "right", "exact name", "family", "joint", "detected", "wrong claim", "unseen before", "after"),
          [(g["group"], str(g["campaigns"]), *(_percent(g[k]) for k in ("right", "exact", "family", "joint", "detected", "wrong_claim")),
            _number(g["error_before"]), _number(g["error_after"])) for g in score["groups"]])
    numbers, confident, unseen = score["parameters"], score["confidence"], score["unseen"]
    say("right: every hidden effect named, or in a class of at most three, and nothing else; healthy: nothing claimed and nothing detected")
    say(f"Size of the equivalence sets {_number(score['class_size']) or '-'}; parameters: median error "
        f"{_percent(numbers['median_error']) or '-'}, 95 % intervals contain the true value in {_percent(numbers['coverage']) or '-'} of "
        f"{numbers['compared']}")
    if unseen["campaigns"]:
        say(f"Unseen motions: error {_number(unseen['median_before'])} before, {_number(unseen['median_after'])} after (medians); "
            f"the error falls by {_percent(unseen['share_of_error']) or '-'}; in {_percent(unseen['made_worse'])} of campaigns it rises")
        truth = unseen["of_the_truth"]
        if truth["campaigns"]:
            say(f"With the recorded motions, the true model has an error of {_number(truth['median_true'])}. Of its improvement over the "
                f"baseline, the corrected models reach {_percent(truth['share']) or '-'} (median of the {truth['better_than_baseline']} of "
                f"{truth['campaigns']} campaigns with an improvement), {_percent(truth['pooled']) or '-'} in total")
    parts = score["placed"]
    if parts["campaigns"]:
        say(f"Campaigns with an effect in a part of them: {parts['campaigns']}; overlap of the part found of 0.6 or more in "
            f"{_percent(parts['overlapping'])}" + ("" if not parts["moments"] else f"; moments within 0.5 s in "
            f"{_percent(parts['moment_told'])} of {parts['moments']} (median error {_number(parts['moment_error_s']) or '-'} s)"))
    table("What was named", ("hidden", "named (times)"), [(hidden, ", ".join(f"{named} ({n})" for named, n in row.items()))
                                                         for hidden, row in score["confusion"].items()])
    for verdict in score["campaigns"]:
        for line in verdict["notes"]:
            say(f"{verdict['campaign']}: {line}")
    if score["missing"]:
        say(f"Without a diagnosis, not scored: {', '.join(score['missing'])}")
    right = "" if confident["right"] is None else f", {_percent(confident['right'])} of them right"
    conclude(f"{score['scored']} diagnoses scored; "
             f"{confident['claims']} claims made with confidence {confident['threshold']} or more{right}.")
