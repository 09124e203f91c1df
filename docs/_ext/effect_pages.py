"""A page per effect, made from its card: what happens, the equation, a picture, what it is mistaken for, its parameters."""

from pathlib import Path

from nnhydro.effects.catalogue import ACTS, card, catalogue
from nnhydro.effects.effect import Effect
from nnhydro.report.effects.effect_figure import picture
from nnhydro.report.figure_file import DPI

PARITY = {"odd": "gives the mirrored torque", "even": "gives the same torque", "mixed": "gives another torque: the effect has a direction"}


def page(effect: type[Effect], known: set[str]) -> str:
    """Return the page as Markdown."""
    facts = card(effect)
    seen = facts["signature"]
    through = ", through what the sensors read" if facts["kind"] == "instrument" else ""
    alike = ", ".join(f"[{name}]({name}.md)" if name in known else name for name in seen["mistaken_for"]) or "nothing known"
    rows = "\n".join(f"| `{p['name']}` | {p['meaning']} | {p['unit']} | {p['bounds'][0]:g} to {p['bounds'][1]:g} |"
                     for p in facts["parameters"])
    return f"""# {facts['name'][0].upper()}{facts['name'][1:]}

`{facts['id']}`, family {facts['family']}, acts on {ACTS[facts['acts']]}{through}

{facts['mechanism']}

```text
{facts['equation']}
```

![Torque of a demonstration motion without and with the effect, and the difference against what drives it]({facts['id']}.png)

For the picture, the size is a quarter of the largest torque.

| | |
| --- | --- |
| Seen | {seen['region']} |
| Depends on | {', '.join(seen['depends_on'])} |
| Mirrored motion | {PARITY[seen['parity']]} |
| At rest | {'it vanishes' if seen['zero_at_rest'] else 'it remains'} |
| Excited by | {seen['excited_by']} |
| Mistaken for | {alike} |
| Source | {facts['source']} |

| parameter | meaning | unit | bounds |
| --- | --- | --- | --- |
{rows}
"""


def index(effects: dict[str, type[Effect]]) -> str:
    """Return the list of all effects as Markdown."""
    rows = "\n".join(f"| [{effect.id}]({effect.id}.md) | {effect.family} | {effect.name} | {effect.signature.region} |"
                     for effect in effects.values())
    pages = "\n".join(effects)
    return f"""# What may be left out

The {len(effects)} effects that a diagnosis looks for, each with a page made from its card. [Write your own](../guide/own_effect.md).

| effect | family | is | looks like |
| --- | --- | --- | --- |
{rows}

```{{toctree}}
:hidden:

{pages}
```
"""


def _changed(path: Path, text: str) -> None:
    """Write only what differs, so that a second build has little to do."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def write_pages(folder: Path) -> None:
    """Write all pages and pictures into `folder`."""
    folder.mkdir(exist_ok=True)
    effects = dict(catalogue())
    _changed(folder / "index.md", index(effects))
    for name, effect in effects.items():
        _changed(folder / f"{name}.md", page(effect, set(effects)))
        if not (folder / f"{name}.png").exists():
            picture(effect).savefig(folder / f"{name}.png", dpi=DPI)  # no page shows the SVG or the CSV


def setup(app):
    """Make the pages before sphinx looks for its sources."""
    app.connect("builder-inited", lambda app: write_pages(Path(app.srcdir) / "effects"))
    return {"parallel_read_safe": True}
