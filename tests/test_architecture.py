"""The tree is the data flow: who may import whom, what is loaded when, what ships."""

import ast
import json
import shutil
import subprocess
import sys
import zipfile
from functools import cache
from pathlib import Path
from statistics import median

import pytest

import nnhydro

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "nnhydro"
ORDER = ("runtime", "recordings", "physics", "effects", "features", "models", "dynamics", "deployment", "fitting",
         "evaluation", "blind_tests", "simulation", "diagnosis", "report", "api", "cli")
# inside diagnosis: what decides sees what is modelled, never the other way round
FLOORS = ("constants", "problem", "model", "noise", "search", "decision", "findings", "calibration", "unexplained", "experiment",
          "corrected_model", "result", "diagnose")
DATA = ("demo",)  # folders that hold files, not modules
ENTRY = ("__main__",)  # may import anything, is imported by nothing
FRONT = PACKAGE / "__init__.py"  # names the public interface for type checkers; imports nothing of it at run time
HEAVY = ("torch", "matplotlib", "sklearn", "pandas", "scipy")
LONGEST, LONGEST_TESTS = 300, 450  # lines; beyond, a file does two things
MOST_MODULES = 12  # in a folder; a registry holds as many as it has members
REGISTRIES = ("blind_tests/truth", "cli", "effects/hypotheses", "evaluation/comparators", "evaluation/protocols", "features",
              "physics/coefficients", "physics/loads", "recordings/checks", "recordings/readers", "simulation/motions")
WITHOUT_UNIT_TESTS = {"__main__.py": "only calls cli/main; tests/cli starts it as python -m nnhydro"}  # module: why it needs none
SHORT = 40  # lines; a module below, outside registries, has a reason to stand alone
SHORT_MODULES = {
    "__main__.py": "Python asks for a file of this name",
    "deployment/compiled/sine.py": "needs numba, which few have installed",
    "deployment/files.py": "knows all exporters, which do not know each other",
    "deployment/onnx/row_blocks.py": "serves the ONNX graph and the tables of the C program",
    "deployment/sine.py": "its numbers serve the C program and numba",
    "diagnosis/constants.py": "the table of docs/diagnosis.md is made of it",
    "diagnosis/decision/form_error.py": "is one statistic, as the other modules of the folder are",
    "diagnosis/problem/impossible_coefficients.py": "is one statistic; the verdict shares its limit",
    "diagnosis/findings/sheets.py": "needs no more than diagnosis.json; findings, report, Python and commands show it",
    "effects/dry_contact.py": "three hypotheses share it, and their folder is a registry",
    "fitting/network/strip_net/latest_nets.py": "training a net does not know who else asks for it",
    "models/corrected_simulation.py": "is a kind of model, and stored as such",
    "models/learned/shrinkage.py": "training and prediction share the rule",
    "physics/threads.py": "fits, benchmarks, simulations and diagnoses share it",
    "recordings/filtering/periodogram.py": "cut-off, band, waves and what remains share it",
    "report/widgets/render.py": "the pages of benchmarks and diagnoses share it",
    "simulation/recipe/per_joint.py": "motions, sensors, controllers and rig limits share its types"}
MEDIAN = (100, 180)  # lines of a module outside registries: shorter ones scatter a thought, longer ones hold several

SOURCES = sorted(PACKAGE.rglob("*.py"))
EVERYTHING = sorted(p for folder in ("nnhydro", "tests", "datasets", "training") for p in (ROOT / folder).rglob("*.py"))


def name_of(path):
    return str(path.relative_to(ROOT))


@cache
def imports(path):
    """Every module that the file imports, at its top or inside its functions, with the line; relative imports begin with a dot."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level:
            found.append(("." * node.level + (node.module or ""), node.lineno))
        elif isinstance(node, ast.ImportFrom):
            found += [(f"{node.module}.{alias.name}", node.lineno) for alias in node.names]
    return found


def level(module):
    """Place in the order of a dotted nnhydro module: 0 for the modules that all else cites (conventions, errors, ...)."""
    parts = module.split(".")
    if len(parts) > 1 and parts[1] in ENTRY:
        return len(ORDER) + 1
    return ORDER.index(parts[1]) + 1 if len(parts) > 1 and parts[1] in ORDER else 0


def module_of(path):
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def library(module):
    return module.split(".")[0]


def importing(files):
    """Every import of every file: the file, the module, and where it stands."""
    assert len(files) > 100
    return [(path, module, f"{name_of(path)}:{line}") for path in files for module, line in imports(path)]


def test_imports_point_upstream_only():
    for path, module, where in importing(SOURCES):
        assert not module.startswith("."), f"{where} imports relatively: write the full name"
        if library(module) == "nnhydro" and path != FRONT:
            assert level(module) <= level(module_of(path)), f"{where} imports {module}, which lies downstream of it"


def test_inside_the_diagnosis_imports_point_upstream_too():
    files = [path for path in SOURCES if PACKAGE / "diagnosis" in path.parents]
    for path in files:
        if path.parent == PACKAGE / "diagnosis" and path.stem == "__init__":
            continue
        here = module_of(path).split(".")[2]
        assert here in FLOORS, f"{name_of(path)} lies in a room without a floor: write it into FLOORS"
        for module, line in imports(path):
            if module.startswith("nnhydro.diagnosis."):
                there = module.split(".")[2]
                assert FLOORS.index(there) <= FLOORS.index(here), f"{name_of(path)}:{line} imports {module}, which lies downstream of it"


def test_libraries_stay_in_their_part_of_the_tree():
    for path, module, where in importing(SOURCES):
        place = path.relative_to(PACKAGE).parts
        if library(module) == "torch":
            assert level(module_of(path)) >= level("nnhydro.physics"), f"{where}: torch begins at physics"
        if library(module) == "pandas":
            frames = place[:2] == ("recordings", "readers") or place[0] in ("sheet.py", "report", "api")
            assert frames, f"{where}: pandas belongs to readers, sheets and report"
        if library(module) == "matplotlib":
            assert place[0] == "report", f"{where}: matplotlib belongs to report"
        if library(module) in ("typer", "rich"):
            assert place[0] == "cli", f"{where}: what is written to a terminal belongs to cli"
        assert library(module) not in ("datasets", "training", "tests"), f"{where}: the package takes paths, it does not import {module}"


def test_nothing_that_models_or_judges_sees_what_blind_tests_hide():
    """A simulation makes concealed worlds, commands conceal and reveal; all else must do without."""
    users = {path.relative_to(PACKAGE).parts[0] for path, module, _ in importing(SOURCES) if module.startswith("nnhydro.blind_tests")}
    assert users <= {"blind_tests", "simulation", "cli"}


def test_every_folder_of_the_package_has_its_place():
    folders = {p.name for p in PACKAGE.iterdir() if p.is_dir() and p.name != "__pycache__"}
    assert folders <= {*ORDER, *DATA}, f"{folders - {*ORDER, *DATA}} have no place in the order of imports"


def test_a_folder_that_is_no_registry_can_be_overlooked():
    folders = {str(path.parent.relative_to(PACKAGE)) for path in SOURCES if path.parent != PACKAGE}
    modules = {name: sum(path.stem != "__init__" for path in (PACKAGE / name).glob("*.py")) for name in folders}
    assert {name: n for name, n in modules.items() if n > MOST_MODULES and name not in REGISTRIES} == {}
    assert set(REGISTRIES) <= folders


def test_a_module_holds_one_thought():
    modules = [path for path in SOURCES if path.stem[:2] != "__" and str(path.parent.relative_to(PACKAGE)) not in REGISTRIES]
    assert MEDIAN[0] <= median(len(path.read_text().splitlines()) for path in modules) <= MEDIAN[1]


def test_a_short_module_has_a_reason_to_stand_alone():
    modules = {path.relative_to(PACKAGE): len(path.read_text().splitlines()) for path in SOURCES if path.stem != "__init__"}
    short = {str(path) for path, lines in modules.items() if lines < SHORT and str(path.parent) not in REGISTRIES}
    assert short - set(SHORT_MODULES) == set(), "put it where it belongs, or say in SHORT_MODULES why it stands alone"
    assert set(SHORT_MODULES) <= {str(path) for path in modules}


def test_no_file_is_too_long_to_read():
    lines = {name_of(path): len(path.read_text().splitlines()) for path in EVERYTHING}
    assert {name: n for name, n in lines.items() if n > (LONGEST_TESTS if name.startswith("tests") else LONGEST)} == {}


@pytest.mark.parametrize("path", sorted([*(ROOT / "datasets").glob("*/truth.py"), *(ROOT / "datasets").glob("strip_*.py")]), ids=name_of)
def test_the_truth_of_a_data_set_knows_nothing_of_nnhydro(path):
    assert "nnhydro" not in {library(module) for module, _ in imports(path)}


@pytest.mark.parametrize("folder", ["datasets", "training"])
def test_what_is_never_imported_is_no_package(folder):
    assert not list((ROOT / folder).rglob("__init__.py"))


def test_the_public_names_are_few():
    public = [name for name in nnhydro.__all__ if not name.startswith("_")]
    assert len(public) <= 25


@pytest.mark.parametrize("name", nnhydro.__all__)
def test_every_public_name_is_there(name):
    assert getattr(nnhydro, name) is not None
    assert name in dir(nnhydro)


def test_type_checkers_see_the_same_public_names_as_the_interpreter():
    declared = {alias: module for module, alias in ((m.rpartition(".")[0], m.rpartition(".")[2]) for m, _ in imports(FRONT))
                if module.startswith("nnhydro")}
    assert declared == nnhydro._PUBLIC


def test_an_unknown_public_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no_such_name"):
        nnhydro.no_such_name  # noqa: B018


def loaded_by(code):
    """The heavy libraries in memory after `code` ran in a fresh interpreter."""
    report = f"import json, sys; sys.stderr.write(json.dumps([m for m in {HEAVY!r} if m in sys.modules]))"
    result = subprocess.run([sys.executable, "-c", f"{code}\n{report}"], capture_output=True, text=True, check=True, cwd=ROOT)
    return json.loads(result.stderr.splitlines()[-1])


@pytest.mark.parametrize("code", ["import nnhydro", "import nnhydro.cli.main", "from nnhydro.cli.main import run; run(['--help'])"])
def test_what_only_asks_for_help_loads_no_heavy_library(code):
    assert loaded_by(code) == []


def test_help_comes_at_once():
    code = "import sys, time; from nnhydro.cli.main import run; run(['--help']); print(time.process_time(), file=sys.stderr)"
    seconds = []  # of the processor: a clock would judge what else the machine has to do
    for _ in range(5):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, cwd=ROOT, text=True)
        seconds.append(float(done.stderr.split()[-1]))
        if seconds[-1] < 0.5:
            return
    pytest.fail(f"nnhydro --help took {min(seconds):.2f} s at best of five; 0.5 s is the limit")


@pytest.mark.slow
def test_the_wheel_holds_the_package_and_nothing_else(tmp_path):
    source = tmp_path / "source"
    for folder in ("nnhydro", "tests", "datasets", "training", "docs"):
        if (ROOT / folder).exists():
            shutil.copytree(ROOT / folder, source / folder, ignore=shutil.ignore_patterns("__pycache__", "*.csv.gz", "runs", "golden"))
    for file in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / file, source / file)
    subprocess.run([sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path)], cwd=source, check=True,
                   capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"nnhydro"}
    assert "nnhydro/py.typed" in names, "without py.typed no type checker sees the hints"
    assert {f"nnhydro/{p.relative_to(PACKAGE)}" for p in SOURCES} <= set(names)
    demo = {f"nnhydro/{p.relative_to(PACKAGE)}" for p in (PACKAGE / "demo").rglob("*") if p.suffix not in (".py", ".pyc") and p.is_file()}
    assert demo <= set(names), f"the demo's {demo - set(names)} do not ship"


def test_an_effect_that_is_a_load_term_wraps_it():
    laws = {path.stem for path in (PACKAGE / "physics" / "loads").glob("*.py")} - {"__init__"}
    both = [path for path in (PACKAGE / "effects" / "hypotheses").glob("*.py") if path.stem in laws]
    assert len(both) >= 6
    for path in both:
        used = {module for module, _ in imports(path)}
        assert any(module.startswith(f"nnhydro.physics.loads.{path.stem}.") for module in used), f"{name_of(path)} writes a law again"


def test_unit_tests_lie_in_the_folders_of_what_they_test():
    unit = ROOT / "tests" / "unit"
    folders = sorted({path.parent.relative_to(unit) for path in unit.rglob("test_*.py")})
    assert [str(folder) for folder in folders if not (PACKAGE / folder).is_dir()] == [], "tests/unit has the folders of nnhydro"


def test_every_module_outside_registries_has_its_unit_tests():
    unit = ROOT / "tests" / "unit"
    modules = [path.relative_to(PACKAGE) for path in SOURCES if path.stem != "__init__"]
    held = [path for path in modules if str(path.parent) not in REGISTRIES]
    untested = {str(path) for path in held if not (unit / path.parent / f"test_{path.name}").is_file()}
    assert untested == set(WITHOUT_UNIT_TESTS), "tests/unit/<folder>/test_<module>.py holds the tests of nnhydro/<folder>/<module>.py"
