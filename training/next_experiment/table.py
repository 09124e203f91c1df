"""What came of the cases, in words and as a table."""

from nnhydro.diagnosis.experiment.proposal import POOR_CHANCE
from nnhydro.evaluation.metrics import interval_of_share


def honest(names: list[dict], hidden: dict) -> bool:
    """Whether nothing else is named than a class that holds what is hidden."""
    return all(hidden["effect"] in finding["class"] for finding in names) and len(names) <= 1


def settled(names: list[dict], hidden: dict) -> bool:
    """Whether the one finding is what is hidden, and stands alone."""
    return [finding["class"] for finding in names] == [[hidden["effect"]]] and names[0]["joint"] == hidden.get("joint")


def words(names: list[dict]) -> str:
    """Return what is named in a line."""
    return "; ".join("/".join(finding["class"]) + (f" ({finding['joint']})" if finding["joint"] else "") for finding in names) or "nothing"


def ambiguous(row: dict) -> bool:
    """Whether a motion is proposed, and what is hidden is not named alone."""
    return row["proposal"] is not None and not settled(row["before"], row["hidden"])


def counts(rows: list[dict]) -> list[tuple[str, int, int]]:
    """Return what is counted, how often it is so, and of how many."""
    asked = [row for row in rows if ambiguous(row)]
    likely = [row for row in asked if row["proposal"]["chance"] >= POOR_CHANCE]
    at_random = [finding for row in asked for finding in row["settled_random"]]
    usual = [finding for row in likely for finding in row["settled_random"]]
    at_once, nothing = sum(settled(r["before"], r["hidden"]) for r in rows), sum(not r["before"] for r in rows)
    return [("named right at once", at_once, len(rows)),
            ("nothing named at first", nothing, len(rows)),
            ("another effect or joint named at first", len(rows) - at_once - nothing - len(asked), len(rows)),
            ("ambiguous, with a proposal", len(asked), len(rows)),
            ("of these the class holds the truth, and nothing else is named", sum(r["honest"] for r in asked), len(asked)),
            ("settled by the proposed motion", sum(r["settled"] for r in asked), len(asked)),
            ("settled by a motion at random", sum(at_random), len(at_random)),
            ("settled where the predicted probability is 0.5 or more", sum(r["settled"] for r in likely), len(likely)),
            ("settled by a motion at random there", sum(usual), len(usual)),
            ("after the proposed motion, the true effect is still named or among the alternatives",
             sum(r["honest_after"] for r in asked), len(asked))]


def share(hits: int, tries: int) -> str:
    """Return a count with the 95 % interval of its share."""
    low, high = interval_of_share(hits, tries, "wilson")
    return f"{hits} of {tries} ({100 * low:.0f} to {100 * high:.0f} %)"


def table(rows: list[dict]) -> str:
    """Return the ambiguous cases as a Markdown table, and the shares that are settled."""
    lines = ["| rig | hides | before | proposed | chance | after | at random |", "| --- | --- | --- | --- | --- | --- | --- |"]
    for row in filter(ambiguous, rows):
        p, hidden = row["proposal"], row["hidden"]
        random = "; ".join("settled" if finding else words(names)
                           for finding, names in zip(row["settled_random"], row["after_random"], strict=True))
        lines.append(f"| {row['rig']} | {hidden['effect']}{' (' + str(hidden['joint']) + ')' if 'joint' in hidden else ''} | "
                     f"{words(row['before'])} | {p['recordings']} x {p['motion']['kind']} | {p['chance']:.2f} | "
                     f"{'settled' if row['settled'] else words(row['after'])} | {random} |")
    return "\n".join([*lines, "", *(f"- {name}: {share(hits, tries)}" for name, hits, tries in counts(rows))])
