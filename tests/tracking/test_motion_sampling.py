import numpy as np
import pytest

from omni_envs.robots import G1
from omni_envs.tracking.config import AdaptiveSampling, ResetConfig
from omni_envs.tracking.motion import MotionLibrary
from omni_envs.tracking.motion_sampling import MotionSampler


@pytest.fixture(scope="module")
def rng():
    return np.random.default_rng(0)


def make(sway, start, frames=(120, 60), **adaptive):
    library = MotionLibrary(G1, [sway(f) for f in frames], 50.0)
    return MotionSampler(library, ResetConfig(start=start, adaptive=AdaptiveSampling(**adaptive)))


def test_uniform_draws_every_start_frame_equally(sway, rng):
    sampler = make(sway, "uniform")
    motion, frame = sampler.draw(rng.random((2, 60_000)))
    place = frame + np.where(motion == 1, 119, 0)
    counts = np.bincount(place, minlength=119 + 59)
    assert len(counts) == 178  # the last frame of a motion leaves nothing to track
    expected = 60_000 / 178
    assert np.abs(counts - expected).max() < 6 * np.sqrt(expected)


def test_start_draws_the_first_frames(sway, rng):
    motion, frame = make(sway, "start").draw(rng.random((2, 1000)))
    assert not frame.any()
    assert 400 < motion.sum() < 600


@pytest.mark.parametrize("start", ["uniform", "adaptive", "start"])
def test_a_share_starts_at_the_first_frames_of_all_motions(sway, rng, start):
    library = MotionLibrary(G1, [sway(120), sway(60)], 50.0)
    sampler = MotionSampler(library, ResetConfig(start=start, start_share=0.3))
    motion, frame = sampler.draw(rng.random((2, 20_000)))
    first = frame == 0
    # Some more where uniform draws over 178 frames, or over two first bins of fifths, hit them.
    assert np.isclose(first.mean(), 1.0 if start == "start" else 0.3, atol=0.025)
    assert abs(motion[first].mean() - 0.5) < 0.03
    assert len(np.unique(frame)) == (1 if start == "start" else 119)


def test_bins_are_about_a_second(sway):
    sampler = make(sway, "adaptive", frames=(120, 60, 325))
    assert np.bincount(sampler.bin_motion).tolist() == [3, 2, 7]  # ⌊T / 50⌋ + 1


def test_adaptive_starts_uniform_over_bins(sway, rng):
    sampler = make(sway, "adaptive", frames=(120,))
    np.testing.assert_allclose(sampler.probabilities(), 1 / 3)
    _, frame = sampler.draw(rng.random((2, 30_000)))
    assert frame.max() <= 118
    counts = np.bincount((frame * 3 / 119).astype(int), minlength=3)
    assert np.abs(counts - 10_000).max() < 500


def test_failures_move_the_average_as_beyondmimic_does(sway):
    sampler = make(sway, "adaptive", frames=(120,))
    ema = np.zeros(3)
    rng = np.random.default_rng(3)
    for _ in range(50):
        frames = rng.integers(0, 119, size=rng.integers(0, 4))
        sampler.record(np.zeros(len(frames), int), frames)
        fails = np.bincount((frames * 3 / 119).astype(int), minlength=3)
        ema = 0.001 * fails + 0.999 * ema
    np.testing.assert_allclose(sampler.failures, ema, rtol=1e-12)
    weight = ema + 0.1 / 3
    np.testing.assert_allclose(sampler.probabilities(), weight / weight.sum())


def test_kernel_spreads_a_failure_to_earlier_bins(sway):
    sampler = make(sway, "adaptive", frames=(225,), kernel=3, uniform=0.0)
    assert sampler.num_bins == 5
    sampler.record(np.array([0]), np.array([140]))  # bin 3
    p = sampler.probabilities()
    np.testing.assert_allclose(p, np.array([0, 0.64, 0.8, 1.0, 0]) / 2.44)
    # Beyond the end the last bin is repeated.
    sampler.reset()
    sampler.record(np.array([0]), np.array([223]))
    np.testing.assert_allclose(
        sampler.probabilities(), np.array([0, 0, 0.64, 0.8 + 0.64, 2.44]) / 4.52
    )


def test_failing_bins_are_drawn_more_often(sway, rng):
    sampler = make(sway, "adaptive", frames=(120, 60))
    for _ in range(200):
        sampler.record(np.array([1]), np.array([50]))
    motion, frame = sampler.draw(rng.random((2, 2000)))
    assert np.mean((motion == 1) & (frame >= 29)) > 0.6
    assert sampler.metrics()["entropy"] < 0.9
    assert sampler.metrics()["top_bin"] == 4
    sampler.reset()
    assert sampler.metrics()["entropy"] == pytest.approx(1.0)


def test_other_modes_do_not_learn(sway):
    sampler = make(sway, "uniform")
    sampler.record(np.array([0]), np.array([3]))
    assert not sampler.failures.any()
