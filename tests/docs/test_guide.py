"""The guide, typed as it stands: every block of every page runs, in the order of the pages, and what they show is what comes out."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from fenced import alike, blocks, run_here

import nnhydro
from nnhydro.diagnosis import diagnose as engine
from nnhydro.diagnosis.diagnose import DiagnosisOptions
from nnhydro.effects.effect import REGISTER
from nnhydro.report.diagnosis import page

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
# one session in one folder, in the order in which the index lists the pages
PAGES = ("guide/first_campaign", "guide/your_data", "guide/baselines", "guide/read_a_diagnosis", "guide/own_effect",
         "guide/plan_a_campaign", "guide/controller", "speed", "cluster", "models", "formats", "api", "dynamics")


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """The empty folder in which the reader begins, and what has been printed last."""
    return {"folder": tmp_path_factory.mktemp("guide"), "out": ""}


def once(real, key):
    """A function that is not asked again for the same `key(*arguments)` and catalogue."""
    found = {}

    def ask(*arguments):
        asked = repr(key(*arguments)), tuple(REGISTER)
        if asked not in found:
            found[asked] = real(*arguments)
        return found[asked]

    return ask


@pytest.fixture(scope="module", autouse=True)
def diagnosed_once():
    """The same recordings and choices are not diagnosed again: another test shows that they give the same.

    Limits of the rig change the next experiment and nothing that is decided. The figures of the first diagnosis alone are drawn.
    """
    def key(campaign, options, **changes):
        return campaign.sha256(), replace(options, baseline=options.baseline or "constant", **changes)

    diagnose = once(DiagnosisOptions.diagnose, lambda options, campaign, *progress: key(campaign, options))
    decide_on = once(engine._decide_on, lambda campaign, names, options, progress: (names, key(campaign, options, limits=None)))
    figures = iter([page.diagnosis_figures])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "diagnosis_figures", lambda *given: next(figures, lambda *others: [])(*given))
        patch.setattr(DiagnosisOptions, "diagnose", lambda *arguments: diagnose(*arguments))
        patch.setattr(engine, "_decide_on", decide_on)
        yield


@pytest.mark.usefixtures("catalogue_as_it_was")
@pytest.mark.parametrize("page", PAGES)
def test_a_page_of_the_guide_runs_as_it_stands(page, session, monkeypatch):
    monkeypatch.chdir(session["folder"])
    names = {"__name__": page}
    for number, block in enumerate(blocks(DOCS / f"{page}.md"), 1):
        if block.file:
            (session["folder"] / block.file).parent.mkdir(parents=True, exist_ok=True)
            (session["folder"] / block.file).write_text(block.text, encoding="utf-8")
        elif block.kind == "sh":
            session["out"] = run_here(block.text)
        elif block.kind == "python":
            exec(compile(block.text, f"{page}, block {number}", "exec"), names)
        else:
            for line in filter(str.strip, block.text.splitlines()):
                assert any(alike(line, came) for came in session["out"].splitlines()), \
                    f"{page} shows {line!r}, but this came out:\n{session['out']}"


def test_every_page_with_code_is_among_those_that_run():
    pages = {str(path.relative_to(DOCS).with_suffix("")) for path in DOCS.rglob("*.md")
             if not {"effects", "_build", "contributing", "decisions"} & set(path.relative_to(DOCS).parts)}
    without_code = {"index", "physics", "networks", "diagnosis", "glossary", "architecture", "common_issues", "decisions",
                    "guide/real_machine"}
    assert pages - without_code == set(PAGES)


def test_every_public_name_has_an_example_that_runs():
    code = "\n".join(block.text for block in blocks(DOCS / "api.md") if block.kind == "python")
    page = (DOCS / "api.md").read_text(encoding="utf-8")
    for name in nnhydro.__all__:
        assert re.search(rf"nnhydro\.{name}\b", code), f"docs/api.md: no example uses nnhydro.{name}"
        explained = name.startswith("__") or re.search(rf"auto\w+:: nnhydro\.{name}$", page, re.M)
        assert explained, f"docs/api.md does not explain nnhydro.{name}"


@pytest.mark.parametrize(("shown", "came", "same"), [
    ("Joint 2 rubs with 0.30 +- 0.002 N m", "Joint 2 rubs with 0.3012 +- 0.0021 N m", True), ("a 1.0 b", "a 1.2 b", False),
    ("a 1.0 b", "a 1.0 c", False), ("An arm  of 2 links", "An arm of 2 links", True)])
def test_shown_lines_are_compared_by_words_and_by_numbers(shown, came, same):
    assert alike(shown, came) == same
