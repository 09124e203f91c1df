"""Time to the same held-out error against scikit-learn's MLPRegressor: `python training/benchmarks/training_time.py`.

Both learn torque / Morison scale from the same features of datasets/rivera_tank, on the same recordings, on one thread; the error is that
of the benchmark (sum |measured - modelled| / sum |measured|) on recordings that neither saw. The peer is standardised, has the same layers
and batch, and learns at the best of several rates; it is judged after every epoch and charged only until it first came within a hundredth
of its best. Ours is charged for whole fits, early stop included, the quickest of several budgets of epochs that is as good as the peer at
its best. Seconds are those of the processor, so that a busy machine does not decide. About two minutes.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import platform  # noqa: E402
import time  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
import sklearn  # noqa: E402
import torch  # noqa: E402
from sklearn.neural_network import MLPRegressor  # noqa: E402
from sklearn.preprocessing import StandardScaler  # noqa: E402

from nnhydro.fitting.config import TrainingConfig  # noqa: E402
from nnhydro.fitting.network.rows import Rows, torque_rms, training_rows  # noqa: E402
from nnhydro.fitting.regressor import TorqueRegressor  # noqa: E402
from nnhydro.recordings.campaign import open_campaign  # noqa: E402
from nnhydro.recordings.splitting import folds, units  # noqa: E402
from nnhydro.runtime.files import write_json  # noqa: E402

CAMPAIGN = Path("datasets/rivera_tank")
EPOCHS, RATES, BUDGETS, SEED, REPEATS = 800, (1e-3, 3e-3), (1, 5, 20, 60, 200), 0, 3
FEATURES = {"features of the default network": None, "groups and torques": ("morison", "groups", "angles", "rates", "wake", "arm")}


def tables(features: tuple[str, ...] | None) -> tuple[Rows, Rows]:
    """Return the rows of the first fold: fitted and held out."""
    campaign = open_campaign(CAMPAIGN)
    config = TrainingConfig(model="network", seed=SEED, **({} if features is None else {"features": features}))
    how = campaign.plan(None)
    every = units(campaign, how, SEED)
    held_out = set(folds(every, 5, SEED)[0])
    chosen = [unit for i, unit in enumerate(every) if i not in held_out]
    floor = config.floor * torque_rms(chosen)
    return (training_rows(chosen, campaign.arm, config, floor, None),
            training_rows([every[i] for i in sorted(held_out)], campaign.arm, config, floor, None))


def error(rows: Rows, scaled: np.ndarray) -> float:
    """Return sum |measured - modelled| / sum |measured| for modelled torque / scale `scaled` (n, joints)."""
    tau = rows.target.double().numpy()
    return float(np.abs(tau - rows.scale.double().numpy() * scaled).sum() / np.abs(tau).sum())


def ours(train: Rows, test: Rows, epochs: int) -> tuple[float, float]:
    """Return seconds (median of several whole fits) and held-out error for at most `epochs` epochs."""
    seconds = []
    for _ in range(REPEATS):
        model = TorqueRegressor(epochs=epochs, parity=train.parity.numpy(), random_state=SEED)
        began = time.process_time()
        model.fit(train.x.double().numpy(), (train.target / train.scale).double().numpy(), groups=train.unit.numpy())
        seconds.append(time.process_time() - began)
    return float(np.median(seconds)), error(test, model.predict(test.x.double().numpy()))


def peer(train: Rows, test: Rows, rate: float) -> list[tuple[float, float]]:
    """Return (seconds of training so far, held-out error) after every epoch."""
    scaler = StandardScaler().fit(train.x.numpy())
    X, X_test = (scaler.transform(rows.x.numpy()) for rows in (train, test))
    y = (train.target / train.scale).numpy()
    model = MLPRegressor(hidden_layer_sizes=(32, 32), activation="tanh", batch_size=256, learning_rate_init=rate, random_state=SEED)
    spent, curve = 0.0, []
    for _ in range(EPOCHS):
        began = time.process_time()
        model.partial_fit(X, y)
        spent += time.process_time() - began
        curve.append((spent, error(test, model.predict(X_test))))
    return curve


def compared(features: tuple[str, ...] | None) -> dict[str, Any]:
    """Return the comparison on one set of features."""
    train, test = tables(features)
    ours(train, test, 1)  # first allocations
    fits = {epochs: ours(train, test, epochs) for epochs in BUDGETS}
    curves = {rate: peer(train, test, rate) for rate in RATES}
    rate = min(RATES, key=lambda r: min(e for _, e in curves[r]))
    best = min(e for _, e in curves[rate])
    reached = next(t for t, e in curves[rate] if e <= 1.01 * best)
    as_good = [(t, e, epochs) for epochs, (t, e) in fits.items() if e <= 1.01 * best]
    seconds, own_error, epochs = min(as_good) if as_good else (*fits[BUDGETS[-1]], BUDGETS[-1])
    return {"rows": len(train.x), "features": train.x.shape[1], "as_good": bool(as_good), "times_as_fast": reached / seconds,
            "nnhydro": {"seconds": seconds, "error": own_error, "epochs": epochs, "all": {str(n): fit for n, fit in fits.items()}},
            "peer": {"seconds": reached, "error": best, "rate": rate, "epochs": EPOCHS, "seconds_in_all": curves[rate][-1][0]}}


def main() -> None:
    """Print and store the comparison."""
    torch.set_num_threads(1)
    machine = f"{platform.machine()}, {os.cpu_count()} cores, one thread; python {platform.python_version()}"
    results = {name: compared(features) for name, features in FEATURES.items()}
    for name, r in results.items():
        print(f"{name}: {r['rows']} rows of {r['features']} features")
        print(f"  MLPRegressor  {r['peer']['seconds']:6.2f} s to its best, held-out error {100 * r['peer']['error']:.2f} % "
              f"(rate {r['peer']['rate']:g}, {EPOCHS} epochs looked at)")
        print(f"  nnhydro       {r['nnhydro']['seconds']:6.2f} s, held-out error {100 * r['nnhydro']['error']:.2f} %; "
              + ", ".join(f"{n} epochs {t:.2f} s {100 * e:.2f} %" for n, (t, e) in r["nnhydro"]["all"].items()))
        print(f"  {r['times_as_fast']:.1f} times as fast" + ("" if r["as_good"] else ", BUT NOT AS GOOD") + f"; {machine}")
    write_json(Path(__file__).with_suffix(".json"), {"results": results, "machine": machine, "versions": {
        "torch": torch.__version__, "numpy": np.__version__, "scikit-learn": sklearn.__version__}})


if __name__ == "__main__":
    main()
