import numpy as np
import pytest

from omni_envs.envs.task import TrackingTask
from omni_envs.errors import UnknownNameError
from omni_envs.robots import G1
from omni_envs.tracking.config import PRESETS, make_config
from omni_envs.tracking.rewards import TRACKING_TERMS


@pytest.fixture
def playback(make, quiet):
    """Puts the simulations exactly on reference frames and judges them against these frames."""

    def judge(frames, **options):
        env = make(len(frames), **{**quiet, **options})
        env.reset(seed=0, options={"motion": 0, "frame": np.asarray(frames)})
        library = env._library
        reference = library.frames(np.asarray(frames))
        simulation = env.simulation
        action = np.zeros((len(frames), 29))
        forces = np.zeros((len(frames), 1, 4, 3))
        bodies = simulation.bodies()
        task = TrackingTask(env.robot, env.config, library.has_object)
        return task.judge(simulation.qpos, bodies, reference, action, action, forces, True)

    return judge


@pytest.mark.parametrize("preset", PRESETS)
def test_playing_the_reference_back_earns_every_tracking_term(playback, preset):
    # Frames whose velocity is a central difference: the simulator is put at the stored qvel.
    judged = playback(np.arange(0, 118, 3), preset=preset)
    reward = PRESETS[preset].reward
    for name in TRACKING_TERMS:
        term = getattr(reward, name)
        if term is None:
            assert name not in judged.terms
            continue
        value = judged.terms[name] / (term.weight * 0.02)
        np.testing.assert_allclose(value, 1.0, atol=1e-6, err_msg=name)
    for name in ("action_rate", "contact"):
        assert not judged.terms[name].any()
    assert not any(test.any() for test in judged.tests.values())


def test_reward_is_the_sum_of_its_terms(make):
    env = make(8)
    env.reset(seed=0)
    for action in np.random.default_rng(0).normal(size=(5, 8, 29)):
        _, reward, terminated, _, infos = env.step(action)
        terms = [infos[k] for k in infos if k.startswith("reward/")]
        assert len(terms) == 11
        np.testing.assert_allclose(reward, np.sum(terms, axis=0), rtol=1e-12)
        tests = [infos[k] for k in infos if k.startswith("terminated/")]
        np.testing.assert_array_equal(terminated, np.any(tests, axis=0))


def test_maximum_reward_per_second(playback):
    assert playback([20]).reward[0] / 0.02 == pytest.approx(7.0, abs=1e-5)
    without = {"object_position": None, "object_orientation": None}
    assert playback([20], reward=without).reward[0] / 0.02 == pytest.approx(5.0, abs=1e-5)


def test_weights_and_sigmas_are_used(playback, make, quiet):
    env = make(1, **quiet)
    env.reset(options={"frame": 10})
    reference = env._library.frames(np.array([10]))
    env.simulation.qpos[:, 2] += 0.1
    env.simulation.place_bodies()
    action = np.zeros((1, 29))
    judged = TrackingTask(env.robot, env.config, has_object=True).judge(
        env.simulation.qpos,
        env.simulation.bodies(),
        reference,
        action + 0.5,
        action,
        np.zeros((1, 1, 4, 3)),
        True,
    )
    assert judged.errors["anchor_position"] == pytest.approx([0.1])
    expected = np.exp(-0.01 / 0.09)
    assert judged.terms["anchor_position"] == pytest.approx([0.5 * expected * 0.02])
    assert judged.terms["body_position"] == pytest.approx([expected * 0.02])
    assert judged.terms["action_rate"] == pytest.approx([-0.1 * 29 * 0.25 * 0.02])


def test_anchor_of_the_presets():
    for preset, body in (("paper", "pelvis"), ("beyondmimic", "torso_link")):
        task = TrackingTask(G1, make_config(preset), has_object=True)
        assert G1.tracked_bodies[task.anchor] == body


def test_soft_limits_are_nine_tenths_of_the_range():
    task = TrackingTask(G1, make_config(), has_object=True)
    low, high = G1.joint_ranges.T
    np.testing.assert_allclose(task.soft_upper - task.soft_lower, 0.9 * (high - low))
    np.testing.assert_allclose(task.soft_upper + task.soft_lower, high + low)


def test_unknown_body():
    config = make_config(reward={"no_orientation": ["left_foot"]})
    with pytest.raises(UnknownNameError, match="no_orientation body 'left_foot'"):
        TrackingTask(G1, config, has_object=False)


def test_noise_of_the_observation_has_the_stated_width(make, quiet):
    env = make(400, **{**quiet, "observation": {"privileged": True}})
    observations, _ = env.reset(seed=0, options={"frame": 30})
    noise = observations["policy"] - observations["critic"][:, :160]
    for term in env.policy_layout.terms:
        drawn = noise[:, term.slice]
        if term.noise == 0:
            assert not drawn.any(), term.name
            continue
        assert np.abs(drawn).max() <= term.noise * (1 + 1e-3)
        quantiles = np.quantile(drawn / term.noise, [0.1, 0.5, 0.9])
        np.testing.assert_allclose(quantiles, [-0.8, 0.0, 0.8], atol=0.05, err_msg=term.name)
