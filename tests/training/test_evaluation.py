import json
from dataclasses import replace

import pytest

from omni_envs.training.evaluation import EVALUATION_FILE, Evaluation, MotionEvaluation


@pytest.fixture
def evaluation() -> Evaluation:
    return Evaluation(
        success_rate=0.75,
        success_ci95=(0.4, 0.9),
        carried_rate=None,
        episodes=8,
        episode_length_mean=20.5,
        episode_length_possible=29,
        return_mean=1.25,
        body_error_mean_m=0.04,
        window_survival_rate=1.0,
        window_seconds_mean=0.58,
        window_body_error_mean_m=0.03,
        windows=64,
        window_seconds=0.58,
        steps=1000,
        seconds=12.5,
    )


def test_a_run_keeps_every_figure(evaluation, tmp_path):
    path = evaluation.save(tmp_path)
    assert path == tmp_path / EVALUATION_FILE
    data = json.loads(path.read_text())
    assert data == evaluation.figures() | {"success_ci95": [0.4, 0.9]}
    assert set(data) == set(vars(evaluation)) - {"motions"}
    again = Evaluation(**{**data, "success_ci95": tuple(data["success_ci95"])})
    assert again == evaluation


def test_motions_are_listed_where_there_are_several(evaluation, tmp_path):
    one = MotionEvaluation(0, 4, 1.0, (0.5, 1.0), 29.0, 29)
    two = replace(one, motion=1, success_rate=0.5)
    path = replace(evaluation, motions=(one, two)).save(tmp_path)
    motions = json.loads(path.read_text())["motions"]
    assert [m["motion"] for m in motions] == [0, 1]
    assert motions[1]["success_rate"] == 0.5 and motions[1]["success_ci95"] == [0.5, 1.0]


def test_a_figure_that_is_no_number_is_not_written(evaluation, tmp_path):
    """Readers of JSON other than Python's stop at NaN."""
    with pytest.raises(ValueError, match="JSON"):
        replace(evaluation, return_mean=float("nan")).save(tmp_path)
    assert not (tmp_path / EVALUATION_FILE).exists()
