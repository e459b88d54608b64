import dataclasses

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from matplotlib.image import imread

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.training.comparison import group_runs, plot_groups
from omni_envs.training.config import PPOConfig, TrainConfig
from omni_envs.training.curve import write_history


def _run(folder, trainer="sb3", seed=0, slope=1.0, updates=10, object_from=None, **ppo):
    """A run whose return grows by ``slope`` per 100 steps."""
    out = folder / f"{trainer}{seed}-{slope}-{updates}"
    TrainConfig(
        "X", out, 1000, trainer, seed=seed, ppo=dataclasses.replace(PPOConfig(), **ppo)
    ).save()
    rows = [
        {
            "steps": 100.0 * k,
            "episode_length": float("nan") if k == 1 else 20.0,
            "episode_return": slope * k,
            "body_error_m": 0.1,
        }
        for k in range(1, updates + 1)
    ]
    for row in rows[object_from:] if object_from is not None else ():
        row["object_error_m"] = 0.01 * row["episode_return"]
    write_history(out, rows)
    return out


@pytest.fixture
def runs(tmp_path):
    return [
        _run(tmp_path, "sb3", 0, 1.0),
        _run(tmp_path, "sb3", 1, 2.0),
        _run(tmp_path, "torchrl", 0, 3.0, updates=8),
    ]


def test_runs_that_differ_by_seed_are_one_group(runs):
    sb3, torchrl = group_runs(runs)
    assert (sb3.label, torchrl.label) == ("trainer sb3", "trainer torchrl")
    assert sb3.runs == tuple(runs[:2]) and torchrl.runs == (runs[2],)


def test_curves_are_compared_at_common_steps(runs):
    """The shortest run has 800 steps; the first update without a finished episode is left out."""
    sb3, torchrl = group_runs(runs)
    for group in (sb3, torchrl):
        assert (group.steps[0], group.steps[-1]) == (200.0, 800.0)
    np.testing.assert_allclose(sb3.curves["episode_return"][1], 2.0 * sb3.steps / 100)
    final = sb3.final()["episode_return"]
    assert final == pytest.approx({"mean": 12.0, "std": np.std([8.0, 16.0], ddof=1)})
    assert torchrl.final()["episode_return"] == pytest.approx({"mean": 24.0, "std": 0.0})


def test_object_is_compared_where_every_run_has_one(tmp_path):
    both = [_run(tmp_path, object_from=0), _run(tmp_path, seed=1, slope=3.0, object_from=0)]
    (group,) = group_runs(both)
    np.testing.assert_allclose(group.curves["object_error_m"][1], 0.03 * group.steps / 100)
    wide = imread(plot_groups([group], tmp_path / "with.png")).shape[1]
    # The second run has none, the third has it in its later rows only.
    for other in (_run(tmp_path, seed=2), _run(tmp_path, seed=3, object_from=5)):
        (group,) = group_runs([both[0], other])
        assert "object_error_m" not in group.curves
        assert imread(plot_groups([group], tmp_path / "without.png")).shape[1] < wide


def test_groups_are_named_by_what_differs(tmp_path):
    runs = [_run(tmp_path), _run(tmp_path, seed=1, clip=0.1), _run(tmp_path, seed=2)]
    assert [g.label for g in group_runs(runs)] == ["ppo.clip 0.2", "ppo.clip 0.1"]
    assert [g.label for g in group_runs(runs[::2])] == ["all runs"]


def test_picture_shows_every_group(runs, tmp_path):
    picture = imread(plot_groups(group_runs(runs), tmp_path / "new" / "curves.png"))
    assert picture.shape[0] > 300 and picture.shape[1] > 1000
    for colour in ((0x1F, 0x5F, 0xA8), (0xD1, 0x66, 0x2B)):
        near = np.abs(picture[..., :3] * 255 - colour).max(axis=-1) < 3
        assert near.sum() > 100


def test_bad_runs_are_one_clear_error(runs, tmp_path):
    with pytest.raises(InvalidDataError, match="at least one run directory"):
        group_runs([])
    with pytest.raises(FileFormatError, match=r"config\.json"):
        group_runs([*runs, tmp_path / "nowhere"])
    path = runs[0] / "curve.csv"
    path.write_text(path.read_text().replace("20.0", "many"))
    with pytest.raises(FileFormatError, match=r"curve\.csv: columns: expected numbers"):
        group_runs(runs)
    path.write_text("steps,episode_length,episode_return,body_error_m\n")
    with pytest.raises(FileFormatError, match="at least one update"):
        group_runs(runs)
    path.unlink()
    with pytest.raises(FileFormatError, match="the curve of a training run"):
        group_runs(runs)
    early = _run(tmp_path, seed=9, updates=2)
    with pytest.raises(InvalidDataError, match="updates at the same steps"):
        group_runs([early, runs[1]])
