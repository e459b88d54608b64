import csv

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from matplotlib.image import imread

from omni_envs.errors import InvalidDataError
from omni_envs.training.curve import plot_curve, smoothed, write_history

HISTORY = [
    {
        "steps": 1e5 * k,
        "seconds": 10.0 * k,
        "episode_length": 20.0 + 5 * k,
        "episode_return": 1.0 * k,
        "body_error_m": 0.1 - 0.01 * k,
        **({"kl": 0.01} if k > 1 else {}),
    }
    for k in range(1, 6)
]


def test_numbers_are_kept_and_rows_may_differ(tmp_path):
    path = write_history(tmp_path, HISTORY)
    with path.open() as file:
        rows = list(csv.DictReader(file))
    assert [float(r["steps"]) for r in rows] == [row["steps"] for row in HISTORY]
    assert rows[0]["kl"] == "" and rows[1]["kl"] == "0.01"
    assert [p.name for p in tmp_path.iterdir()] == ["curve.csv"]


def test_picture_shows_something(tmp_path):
    picture = imread(plot_curve(tmp_path, HISTORY, 0.02))
    assert picture.shape[0] > 200 and picture.shape[1] > 800
    assert picture[..., :3].std() > 0.02


def test_an_object_is_a_panel_of_its_own_also_where_only_later_rows_tell_it(tmp_path):
    later = [{**row, "object_error_m": 0.2} for row in HISTORY[2:]]
    width = imread(plot_curve(tmp_path, HISTORY, 0.02)).shape[1]
    assert imread(plot_curve(tmp_path, HISTORY[:2] + later, 0.02)).shape[1] == width * 4 // 3


def test_nothing_to_draw_is_one_clear_error(tmp_path):
    with pytest.raises(InvalidDataError, match="at least one update"):
        plot_curve(tmp_path, [], 0.02)


def test_smoothing_is_the_mean_of_the_last_values():
    values = np.arange(200.0)
    values[0] = np.nan
    smooth = smoothed(values)
    assert np.isnan(smooth[0]) and smooth[1] == 1.0
    for i in (3, 4, 150, 199):
        assert smooth[i] == np.nanmean(values[max(0, i - 3) : i + 1])
