"""Progress tells the time left once it has a pace."""

from nnhydro.cli.terminal import progress


def test_progress_tells_the_time_left_once_it_has_a_pace(capsys, monkeypatch):
    clock = iter([0.0, 10.0, 20.0, 30.0, 40.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    with progress.steps_on_screen(4) as report:
        for step in ("fold 1: constant", "fold 1: network", "fold 1: network, epoch 10/40", "fold 2: constant"):
            report(step)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "fold 1: constant"
    assert lines[1] == "fold 1: network (about 30 s left)"
    assert len(lines) == 3, "news of a step under way is no line of its own"


def test_there_is_no_time_left_without_a_pace_and_none_at_the_end(monkeypatch):
    monkeypatch.setattr(progress.time, "monotonic", lambda: 20.0)
    assert progress.time_left(0.0, 2, 6) == " (about 40 s left)"
    assert progress.time_left(0.0, 0, 6) == progress.time_left(0.0, 6, 6) == progress.time_left(0.0, 2, None) == ""


def test_a_training_without_a_terminal_is_a_line_every_twentieth_of_the_way(capsys, monkeypatch):
    clock = iter(float(k) for k in range(200))
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    with progress.epochs_on_screen() as report:
        for epoch in range(1, 101):
            report(epoch, 100, 0.25)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == progress.LINES
    assert lines[0] == "epoch 5/100: validation error 25 % of the rms torque to be learned, 95 s left at most"
    assert lines[-1] == "epoch 100/100: validation error 25 % of the rms torque to be learned"
