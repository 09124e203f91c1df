"""`nnhydro gains`: how the torques of a model change with speed and acceleration: effective damping and inertia."""

from pathlib import Path

import typer

from nnhydro.cli.terminal.output import JSON, QUIET, conclude, emit, say, shell_words, table

MOST = 1e3  # rad, rad/s, m/s: beyond it a number is a slip of the unit or of the keyboard


def gains(
    model: Path = typer.Argument(help="Folder of a model that identify, train or diagnose wrote."),
    out: Path = typer.Option(Path("nnhydro_out/gains"), "--out", help="Folder for gains.json and the figure."),
    speed: float = typer.Option(2.0, "--speed", help="Greatest joint speed, rad/s."),
    tow: float = typer.Option(0.0, "--tow", help="Speed of the carriage, m/s."),
    posture: str = typer.Option("", "--posture", help="Comma-separated joint angles, rad; 0 by default."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Print how the torques change with speed and acceleration.

    Prints effective damping and inertia: derivatives of the torques with respect to joint rates and accelerations. Shows them for the
    model, its baseline and the textbook model.
    """
    from nnhydro.dynamics.inertia_check import inertia_check
    from nnhydro.errors import require
    from nnhydro.models.gains.sweeps import Around, document, sweeps
    from nnhydro.models.storage import load_model
    from nnhydro.report.models.gains import gain_figure, gain_rows, gain_verdict
    from nnhydro.runtime.files import check_folder, json_text, whole_folder

    try:
        angles = tuple(float(x) for x in posture.split(",") if x.strip())
    except ValueError:
        angles = (float("nan"),)
    require(all(abs(x) < MOST for x in angles), f"--posture {posture!r}: give angles between -{MOST:g} and {MOST:g} rad, as in "
            "--posture 0.3,-0.5")
    require(abs(tow) < MOST, f"--tow {tow}: give the speed of the carriage in m/s, between -{MOST:g} and {MOST:g}")
    require(0 < speed < MOST, f"--speed {speed}: give the greatest joint speed in rad/s, above 0 and below {MOST:g}")
    check_folder(out, "gains.json")
    loaded, around = load_model(model), Around(speed, tow, angles)
    made = sweeps(loaded, around)
    checked = inertia_check(loaded)
    result = {**document(loaded, around, made), "inertia_check": None if checked is None else checked.document()}
    with whole_folder(out, "gains.json") as folder:
        (folder / "gains.json").write_text(json_text(result), encoding="utf-8")
        gain_figure(made, result["model"], folder / "gains", loaded.arm.sliding)
    if json:
        emit(result)
        return
    columns, rows = gain_rows(made)
    columns = [loaded.arm.text(name) for name in columns]
    table(f"{result['model']}: gains of joints that move alone, wake developed", columns, rows)
    if checked is not None:
        say(checked.sentence())
    conclude(loaded.arm.text(gain_verdict(made)), [out / "gains.json", out / "gains.png"],
             f"nnhydro export {shell_words(model)} --format onnx --out {shell_words(model.name)}.onnx   (for a controller)")
