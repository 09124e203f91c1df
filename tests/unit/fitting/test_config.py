"""Every choice of a training, parsed once."""

import pytest

from nnhydro.errors import ConfigError
from nnhydro.fitting.config import TrainingConfig, read_config


def test_a_configuration_that_is_not_there_says_so_in_the_systems_words(tmp_path):
    with pytest.raises(ConfigError, match=r"none.toml: cannot be read \(No such file or directory\): check the path"):
        read_config(tmp_path / "none.toml")


@pytest.mark.parametrize(("text", "said"), [
    ("epoch = 3", "unknown key 'epoch': did you mean 'epochs'"), ("epochs = 0", "epochs"), ("hidden = [0]", "1 to 4096"),
    ("features = ['waves']", "unknown feature set 'waves'"), ("features = []", "name some"), ("law = ['bend', 'bend']", "stands twice"),
    ("law = ['morison']", "memory"), ("layers = 'both'", "layers"),
    ("baseline = 'nope'", "drag-only"), ("epochs = [", "not valid TOML"), ("learning_rate = nan", "learning_rate"),
])
def test_a_faulty_configuration_is_refused_in_one_line_with_its_key(tmp_path, text, said):
    path = tmp_path / "c.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=said) as caught:
        read_config(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value).strip()


def test_a_configuration_is_read(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text("model = 'network'\nhidden = [8, 4, 2]\nlayers = 'parallel'\nfeatures = ['raw', 'travel']\nlaw = []\nmembers = 2\n")
    assert read_config(path) == TrainingConfig(model="network", hidden=(8, 4, 2), layers="parallel", features=("raw", "travel"), law=(),
                                               members=2)


def test_the_smallest_training_is_allowed():
    chosen = TrainingConfig(hidden=(1,), members=1, epochs=1, patience=1)
    assert chosen.hidden == (1,)
    assert TrainingConfig(hidden=(4096,)).hidden == (4096,)
    assert (TrainingConfig(cutoff_hz=0.5).cutoff_hz, TrainingConfig(bound=0.5).bound) == (0.5, 0.5)
    assert TrainingConfig(learning_rate=1.0).learning_rate == 1.0
    with pytest.raises(ValueError, match="learning_rate"):
        TrainingConfig(learning_rate=1.5)
    for name in ("cutoff_hz", "bound"):
        with pytest.raises(ValueError, match=name):
            TrainingConfig(**{name: 0.0})
    with pytest.raises(ValueError, match="1 to 4096 neurons"):
        TrainingConfig(hidden=(8, 4097))
    with pytest.raises(ValueError, match="1 to 4096 neurons"):
        TrainingConfig(hidden=(0,))
