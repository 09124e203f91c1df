"""How much of the water's force a net learns, by its training: `python training/strip_memory/run.py FOLDER [CASE ...]`, from the root.

FOLDER holds what rows.py wrote. All nets of a case are trained side by side, on a GPU where there is one: two minutes with
eight starts on an H100, half an hour with two on one core. Cases: config.toml; those in results.json are not run again. Table: README.md. No nnhydro is imported.
"""

import json
import sys
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from net import Steps, StripMemories
from torch import Tensor

HERE = Path(__file__).parent
CONFIG = tomllib.loads((HERE / "config.toml").read_text())
SOFT, STATED, TINY = 0.03, 1e-3, 1e-6
HEAD = """# Trainings of the trained memory

`python training/strip_memory/rows.py FOLDER` writes what the nets see. `python training/strip_memory/run.py FOLDER` trains them and prints
this table; `config.toml` holds all choices, `results.json` all numbers. Each net is trained on four fifths of the recordings and judged on
the others. It stands for all that the water does; the package uses such a net by its share beside what else a hybrid learns. A net `on
forces` is trained on the true force of every strip, which no rig measures. It shows how much of the force the history of a strip holds for
a net of so many recordings. The trainings were chosen on this table: its figures are somewhat optimistic.

error = sum |tau - model| / sum |tau| in %. sd: standard deviation over first numbers. mean: error of the mean of a fold's nets.
fitted: error on the recordings of the training. s: seconds of all nets of a set together.

| data | training | steps | error | sd | mean | fitted | s |
| --- | --- | --- | --- | --- | --- | --- | --- |"""


class Nets:
    """The nets of all folds and starts, what they are trained on, and their scales."""

    def __init__(self, data: dict[str, Any], folds: list[tuple[Any, Any]], starts: int, case: dict[str, Any]) -> None:
        self.data, self.case, self.part = data, case, "whole" if case["forces"] else "stretch"
        unit = data[f"{self.part}/unit"].tolist()
        self.own = [[i for i, u in enumerate(unit) if u in fitted] for fitted, _ in folds for _ in range(starts)]
        x, r, left, keep = (data[f"{self.part}/{name}"] for name in ("x", "r", "left", "keep"))
        self.spread = torch.stack([x[of].square().mean(dim=(0, 1, 2)).sqrt() + 1e-3 for of in self.own])[:, None, None]
        self.middle, self.wide = (torch.stack([z(r[of]) for of in self.own])[:, None, None, None] for z in (torch.mean, torch.std))
        self.scale = torch.stack([left[of][keep[of]].abs().mean(dim=0) for of in self.own])[:, None, None]
        self.net = StripMemories(len(self.own), x.shape[-1], case["size"], data["whole/columns"].shape[-1], data["whole/plain"].shape[-1])
        self.net.to(x.device)

    def loads(self, part: str, index: Tensor, training: bool) -> Tensor:
        """The loads (e, runs, t, strips) of the runs `index` (e, runs)."""
        def beside(name: str) -> Tensor:
            z = self.data[f"{part}/{name}"][index]
            return z.transpose(1, 2).flatten(2, 3)

        x, r, speeds, plain = (beside(name) for name in ("x", "r", "speeds", "plain"))
        x, r = x / self.spread, (r - self.middle) / (self.wide + 0.01)
        if training:
            x = x + self.case["noise"] * torch.randn_like(x)
        nets, runs = index.shape
        dt = self.data[f"{part}/way"][index].transpose(1, 2)[..., None].expand(-1, -1, -1, x.shape[2] // runs).flatten(2)[..., None]
        way = (torch.cat([speeds[:, :1], speeds[:, :-1]], dim=1) + speeds) / 2 * dt
        y = self.net(x, r, way, speeds[..., 0] ** 2, plain, self.case["dropped"] if training else 0.0)
        return y.reshape(nets, y.shape[1], runs, -1).transpose(1, 2)

    def torque(self, part: str, index: Tensor, load: Tensor) -> Tensor:
        """The torques (e, runs, t, joints) N m of loads, as the sensor sees them."""
        levers, columns, low_pass = (self.data[f"{part}/{name}"][index] for name in ("levers", "columns", "low_pass"))
        tau = torch.einsum("ertjs,erts->ertj", levers, load) + torch.einsum("ertjp,ep->ertj", columns, self.net.body)
        return low_pass @ tau

    def loss(self, index: Tensor) -> Tensor:
        """What is left of the runs `index`, of every net alike."""
        load, keep = self.loads(self.part, index, True), self.data[f"{self.part}/keep"][index][..., None]
        if self.case["forces"]:
            force = self.data["force"][self.data[f"{self.part}/unit"][index]]
            weight = self.data[f"{self.part}/levers"].abs().amax(dim=(1, 2))[index][:, :, None] / self.scale[..., :1]
            off, there = weight * (load - force), weight * force
        else:
            left = self.data[f"{self.part}/left"][index]
            off, there = (self.torque(self.part, index, load) - left) / self.scale, left / self.scale
        misfit = (torch.hypot(off, torch.full_like(off, SOFT)) * keep).sum(dim=(2, 3))
        size = (there.abs() * keep).sum(dim=(2, 3)) + TINY
        stated = STATED * (self.net.body.square().sum(dim=1) + self.net.plain.square().sum(dim=1))
        return ((misfit / size.sqrt()).sum(dim=1) / size.sum(dim=1).sqrt() + stated).sum()

    def train(self, rng: np.random.Generator) -> int:
        """Train all nets; the number of steps."""
        case = self.case
        batches = -(-max(map(len, self.own)) // case["batch"])
        steps = Steps(self.net, case["epochs"] * batches, case["rate"], case["matrix_rate"], case["decay"])
        for _ in range(case["epochs"]):
            orders = [np.concatenate([rng.permutation(of) for _ in range(2)])[:batches * case["batch"]] for of in self.own]
            for index in np.split(np.stack(orders), batches, axis=1):
                steps.step(self.loss(torch.from_numpy(index).to(self.scale.device)))
        return int(case["epochs"] * batches)


def judge(data: dict[str, Any], case: dict[str, Any]) -> dict[str, Any]:
    """Errors of a training, in %."""
    torch.manual_seed(0)
    count, starts = len(data["tau"]), CONFIG["starts"]
    prefix = f"{CONFIG['protocol']}/"
    folds = [(set(data[f"{prefix}{k}/fitted"].tolist()), set(data[f"{prefix}{k}/held_out"].tolist()))
             for k in range(sum(key.startswith(prefix) for key in data) // 2)]
    begin, nets = time.perf_counter(), Nets(data, folds, starts, case)
    steps = nets.train(np.random.default_rng(0))
    seconds = time.perf_counter() - begin
    with torch.no_grad():
        each = [torch.full((len(nets.own), 1), u, device=data["tau"].device) for u in range(count)]
        tau = torch.cat([nets.torque("whole", index, nets.loads("whole", index, False)) for index in each], dim=1)
    tau, left, keep, size = tau.unflatten(0, (len(folds), starts)), data["whole/left"], data["whole/keep"], data["tau"]

    def error(made: Any, parts: Sequence[set[int]]) -> float:
        pairs = [(fold, u) for fold, part in enumerate(parts) for u in part]
        return 100 * sum(float((made[fold, u] - left[u])[keep[u]].abs().sum()) for fold, u in pairs) / sum(
            float(size[u][keep[u]].abs().sum()) for _, u in pairs)

    fitted, held = zip(*folds, strict=True)
    single, own = ([error(tau[:, k], parts) for k in range(starts)] for parts in (held, fitted))
    return {"steps": steps, "error": float(np.mean(single)), "sd": float(np.std(single)), "mean": error(tau.mean(dim=1), held),
            "fitted": float(np.mean(own)), "s": seconds}


def table(results: dict[str, Any]) -> str:
    """The page."""
    lines = []
    for key, r in ((key, r) for key, r in results.items() if key != "made with"):
        errors = " | ".join(f"{r[name]:.1f}" for name in ("error", "sd", "mean", "fitted"))
        lines.append(f"| {key.replace(': ', ' | ', 1)} | {r['steps']} | {errors} | {r['s']:.0f} |")
    return "\n".join([HEAD, *lines, "", f"Made with {results['made with']}.", ""])


def main() -> None:
    """Run what is named, all by default, and is not there yet."""
    torch.set_num_threads(1)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    path = HERE / "results.json"
    results = json.loads(path.read_text()) if path.exists() else {}
    results["made with"] = f"torch {torch.__version__} on {torch.cuda.get_device_name() if device == 'cuda' else 'one core'}"
    for name in CONFIG["sets"]:
        with np.load(Path(sys.argv[1]) / f"{name}.npz") as stored:
            data = {key: torch.from_numpy(z.astype(np.float32) if z.dtype == np.float64 else z).to(device) for key, z in stored.items()}
        for called, case in CONFIG["cases"].items():
            key = f"{name}: {called}"
            if key not in results and (not sys.argv[2:] or called in sys.argv[2:]):
                results[key] = judge(data, CONFIG["usual"] | case)
                print(key, results[key], flush=True)
                path.write_text(json.dumps(results, indent=1) + "\n")
    (HERE / "README.md").write_text(table(results))


if __name__ == "__main__":
    main()
