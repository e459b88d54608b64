import numpy as np
import pytest

from omni_envs.envs.episodes import GATE_EPISODES, Episodes, NoiseLevel, ObjectGate
from omni_envs.robots import G1
from omni_envs.tracking import kernels
from omni_envs.tracking.config import NoiseGrowth, make_config
from omni_envs.tracking.motion import MotionLibrary


@pytest.fixture
def library(sway):
    return MotionLibrary(G1, [sway(120), sway(60)], 50.0)


def start(library, num=3000, max_steps=500, **options):
    config = make_config(**options)
    episodes = Episodes(library, G1.default_joint_array, num, config, max_steps)
    rng = np.random.default_rng(0)
    draws = rng.random((episodes.draws, num))
    episodes.start(np.arange(num), np.zeros(num, int), np.full(num, 10), draws)
    return episodes, rng


def count(episodes):
    """Moves on by a control step; returns (N,) which episodes lack motion or time."""
    num = len(episodes.motion)
    truncated, done = np.empty(num, bool), np.empty(num, bool)
    kernels.advance(episodes.clocks, np.zeros(num, bool), np.arange(num), truncated, done)
    np.testing.assert_array_equal(truncated, done)
    return truncated


def test_the_frame_after_the_start_is_tracked_first(library):
    episodes, _ = start(library, 2)
    assert episodes.frame.tolist() == [11, 11]
    assert episodes.rows.tolist() == [11, 11]
    draws = np.random.default_rng(0).random((episodes.draws, 1))
    episodes.start(np.array([1]), np.array([1]), np.array([4]), draws)
    assert episodes.rows.tolist() == [11, 125]


def test_the_last_frame_is_judged_and_then_the_episode_is_over(library):
    episodes, _ = start(library, 1)
    judged = []
    for _ in range(200):
        judged.append(int(episodes.frame[0]))
        if count(episodes)[0]:
            break
    assert judged == list(range(11, 120))
    assert episodes.frame[0] == 119
    assert episodes.elapsed[0] == episodes.possible[0] == 109


def test_time_out(library):
    episodes, _ = start(library, 1, max_steps=7)
    assert [bool(count(episodes)[0]) for _ in range(7)] == [False] * 6 + [True]


def test_joint_default_is_offset_per_episode(library):
    episodes, rng = start(library)
    offset = episodes.default - G1.default_joint_array
    assert np.abs(offset).max() <= 0.01
    np.testing.assert_allclose(np.quantile(offset, [0.1, 0.9]), [-0.008, 0.008], atol=3e-4)
    kept = episodes.default[1:].copy()
    draws = rng.random((episodes.draws, 1))
    episodes.start(np.array([0]), np.array([0]), np.array([0]), draws)
    assert (episodes.default[0] != G1.default_joint_array + offset[0]).all()
    np.testing.assert_array_equal(episodes.default[1:], kept)


def test_pushes_come_every_one_to_three_seconds(library):
    episodes, rng = start(library, 500)
    times = [[] for _ in range(500)]
    for step in range(1, 1000):
        count(episodes)
        for i in episodes.due_pushes(rng):
            times[i].append(step)
    gaps = np.concatenate([np.diff([0, *t]) for t in times])
    assert gaps.min() >= 50
    assert gaps.max() <= 150
    np.testing.assert_allclose(np.quantile(gaps, [0.1, 0.5, 0.9]), [60, 100, 140], atol=5)


def test_no_pushes(library):
    episodes, rng = start(library, 5, randomization={"push": None})
    for _ in range(400):
        count(episodes)
        assert not len(episodes.due_pushes(rng))


def test_the_object_gate_opens_for_good():
    gate = ObjectGate(0.5)
    gate.record(np.full(GATE_EPISODES - 1, 10), np.full(GATE_EPISODES - 1, 10))
    assert not gate.open  # too few episodes to tell
    gate.record(np.full(200, 40), np.full(200, 100))
    assert not gate.open
    gate.record(np.full(GATE_EPISODES, 60), np.full(GATE_EPISODES, 100))
    assert gate.open
    gate.record(np.full(200, 1), np.full(200, 100))
    assert gate.open
    gate.reset()
    assert not gate.open
    assert ObjectGate(0.0).open


def test_start_noise_grows_with_what_episodes_last():
    level = NoiseLevel(NoiseGrowth(share=0.5, step=0.25))
    half = np.full(GATE_EPISODES // 2, 10)
    assert level.level == 0.0
    for expected in (0.0, 0.25, 0.25, 0.5):  # a step per hundred episodes
        level.record(half // 2, half)
        assert level.level == expected
    level.record(np.full(GATE_EPISODES, 4), np.full(GATE_EPISODES, 10))
    assert level.level == 0.25
    for _ in range(9):
        level.record(np.full(GATE_EPISODES, 10), np.full(GATE_EPISODES, 10))
    assert level.level == 1.0
    rng = np.random.default_rng(0)
    share = level.shares(rng.random(4000))
    np.testing.assert_allclose(np.quantile(share**2, [0.1, 0.5, 0.9]), [0.1, 0.5, 0.9], atol=0.03)
    level.reset()
    assert not level.shares(rng.random(5)).any()


def test_start_noise_that_does_not_grow_is_whole():
    level = NoiseLevel(None)
    level.record(np.zeros(500), np.ones(500))
    assert level.level == 1.0
    assert level.shares(np.full(5, 0.5)) is None
