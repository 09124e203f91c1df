"""The page of the study: one table of errors under every protocol, one of coverage."""

FIRST = "leave-recordings-out"
HEAD = """# Every model under every protocol

**Measured with nnhydro {version}; figures of another version may differ.**

`python training/rivera_tank/run.py` ({minutes} minutes on two cores; choices in config.toml, every number in results.json).
Error: McLain & Rock's sum |measured - model| / sum |measured| on recordings held out of the fit, in %. datasets/rivera_tank, synthetic;
noise floor {floor:.2f} %. leave-arm-out: three simulated arms of slenderness 0.7, 1 and 1.4 (arms.yaml).
"""


def _table(columns: list[str], rows: list[list[str]]) -> str:
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _versions(results: dict) -> str:
    """The versions that made the results, each once."""
    return ", ".join(dict.fromkeys(result["versions"]["nnhydro"] for result in results.values()))


def _errors(results: dict) -> str:
    names = list(next(iter(results.values()))["models"])
    rows = []
    for name in names:
        told = [results[p]["models"].get(name) for p in results]
        rows.append([name, *(f"{100 * m['error']:.1f}" if m else "" for m in told)])
    return _table(["model", *results], rows)


def _folds(result: dict) -> str:
    folds = result["folds"]
    return _table(["model", *(fold["name"] for fold in folds)],
                  [[name, *(f"{100 * fold['errors'][name]:.1f}" for fold in folds)] for name in result["models"]])


def _coverage(results: dict) -> str:
    rows = []
    for protocol, result in results.items():
        for name, model in result["models"].items():
            if "coverage" in model:
                shares = [f"{100 * share:.0f}" for share in model["coverage"]["shares"].values()]
                rows.append([protocol, name, *shares, f"{100 * model['coverage']['width']:.1f}",
                             f"{model['coverage'].get('wider_than_fitted', float('nan')):.2f}"])
    return _table(["protocol", "model", "of 50 %", "of 80 %", "of 95 %", "std / torque, %", "wider than fitted"], rows)


def page(results: dict) -> str:
    """Return README.md for the results by protocol, the default protocol first."""
    results = dict(sorted(results.items(), key=lambda item: item[0] != FIRST))
    minutes = sum(result["seconds"] for result in results.values()) / 60
    floor = next((100 * result["noise_floor"] for result in results.values() if result["noise_floor"] is not None), float("nan"))
    text = HEAD.format(version=_versions(results), minutes=round(minutes), floor=floor) + "\n" + _errors(results)
    for protocol, result in results.items():
        if protocol != FIRST:
            text += f"\n## {protocol}: error where is held out, %\n\n{_folds(result)}"
    return text + f"\n## Coverage: share of held-out torques within the intervals, %\n\n{_coverage(results)}"
