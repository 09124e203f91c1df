"""`nnhydro arm`: arm.yaml from a URDF."""

from pathlib import Path

import typer

from nnhydro.cli.terminal.output import JSON, QUIET, conclude, emit, say, shell_words


def arm(
    urdf: Path = typer.Argument(metavar="FILE.urdf", help="The robot: a serial chain of revolute joints with parallel axes."),
    out: Path = typer.Option(..., "--out", help="File to write: arm.yaml in the campaign's folder."),
    diameter: str = typer.Option("", "--diameter", help="Comma-separated diameters of the links, m, where the file has no cylinders."),
    density: float = typer.Option(1000.0, "--density", help="Density of the fluid, kg/m3; 0 for a dry arm."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Make arm.yaml from a URDF.

    Lists what a URDF counts otherwise or does not contain: the frame, zeros of angles, the weight, the water.
    """
    from nnhydro.deployment.formats.urdf import arm_yaml, read_urdf
    from nnhydro.errors import ConfigError, require
    from nnhydro.runtime.files import write_output

    try:
        diameters = tuple(float(x) for x in diameter.split(",") if x.strip())
    except ValueError as cause:
        raise ConfigError(f"--diameter {diameter!r}: give numbers in metres, as in --diameter 0.07,0.06") from cause
    require(out.suffix in (".yaml", ".yml"), f"--out {out}: give a file that ends in .yaml, such as my_campaign/arm.yaml")
    require(not (out.exists() or out.is_symlink()), f"--out {out}: is there already: name another file, or remove it")
    found = read_urdf(urdf, diameters, density)
    write_output(out, arm_yaml(found.arm, [f"from {urdf.name}", *found.notes]), [urdf])
    if json:
        emit({"arm": found.arm.document(), "notes": list(found.notes), "file": str(out)})
        return
    for note in found.notes:
        say(f"note    {note}")
    links = found.arm.n_links
    conclude(f"An arm of {links} link{'s' if links > 1 else ''}, {float(found.arm.L.sum()):.3g} m long.", [out],
             f"nnhydro check {shell_words(out.parent)}   (once {out.parent / 'recordings'} holds your runs)")
