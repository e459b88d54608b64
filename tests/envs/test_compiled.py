"""The compiled loops are held to the plain functions on arrays."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from omni_envs.envs.batches import empty_observations
from omni_envs.envs.compiled import CompiledTask
from omni_envs.envs.episodes import Episodes
from omni_envs.envs.model import EnvModel, build_model
from omni_envs.envs.task import TrackingTask
from omni_envs.robots import G1
from omni_envs.tracking import kernels, observations
from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.config import make_config
from omni_envs.tracking.motion import MotionLibrary
from omni_envs.tracking.randomization import start_state

CASES = {
    "paper": {},
    "beyondmimic": {"preset": "beyondmimic"},
    "blind": {"observation": {"state_estimation": False, "noise": None}},
    "critic": {"observation": {"privileged": True}, "anchor": "torso"},
    "flip": {
        "reward": {
            "no_orientation": ("left_ankle_roll_link", "right_ankle_roll_link"),
            "contact_rule": "substeps",
            "object_position": None,
        },
        "termination": {"end_effector_height": 0.5, "anchor_tilt": None, "object_angle": None},
        "reset": {"noise": None},
    },
    "alone": {},
}


@pytest.fixture(params=CASES)
def case(request, sway):
    """A task bound plainly and compiled, and 40 states close to frames of its motion."""
    config = make_config(**CASES[request.param])
    motion = sway(with_object=False) if request.param == "alone" else sway()
    library = MotionLibrary(G1, [motion], 50.0)
    plain = TrackingTask(G1, config, library.has_object)
    model = build_model(G1, motion.scene, config)
    rng, num = np.random.default_rng(3), 40
    rows = rng.integers(library.num_frames - 1, size=num)
    frames = library.frames(rows)
    qpos, qvel = plain.full_state(frames)
    qpos, qvel = qpos + 0.2 * rng.normal(size=qpos.shape), qvel + 0.5 * rng.normal(size=qvel.shape)
    bodies = [part + 0.2 * rng.normal(size=part.shape) for part in frames.bodies]
    for quaternions in (qpos[:, 3:7], bodies[1], qpos[:, 39:43]):
        quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
    action = rng.normal(size=(2, num, 29))
    state = SimpleNamespace(
        library=library,
        rows=rows,
        frames=frames,
        qpos=qpos,
        qvel=qvel,
        bodies=Bodies(*bodies),
        action=action[0],
        previous=action[1],
    )
    return plain, CompiledTask(plain, library, num, model.samples), state, model, rng


def judge(compiled, s, history, object_active, diverged):
    """(reward, terminated, figures, flags) of states whose bodies need not hang together."""
    num = len(s.rows)
    figures, flags = np.empty((len(compiled.figures), num)), np.empty((5, num), bool)
    reward, terminated = np.empty(num), np.empty(num, bool)
    kernels.judge(
        compiled.numbers, s.library.at, s.library.table, s.rows, s.qpos, s.bodies, s.action,
        s.previous, history, object_active, diverged, np.arange(num), figures, flags, reward,
        terminated,
    )  # fmt: skip
    return SimpleNamespace(reward=reward, terminated=terminated, figures=figures, flags=flags)


def observe(compiled, s, default, share, ids, policy, critic):
    kernels.observe(
        compiled.numbers, s.library.at, s.library.table, s.rows, s.qpos, s.qvel, s.bodies, default,
        s.action, 5, share, ids, policy, critic,
    )  # fmt: skip


def sensor_history(model: EnvModel, num: int, rng) -> np.ndarray:
    return rng.normal(size=(num, model.model.nhistory)) * rng.choice([0.1, 2.0], (num, 1))


@pytest.mark.parametrize("object_active", [False, True])
def test_judgements_agree(case, object_active):
    plain, compiled, s, model, rng = case
    history = sensor_history(model, len(s.rows), rng)
    forces = model.contact_forces(history)
    expected = plain.judge(s.qpos, s.bodies, s.frames, s.action, s.previous, forces, object_active)
    diverged = np.zeros(len(s.rows), bool)
    found = judge(compiled, s, history, object_active, diverged)
    np.testing.assert_allclose(found.reward, expected.reward, atol=1e-12)
    figures = {f"reward/{k}": v for k, v in expected.terms.items()}
    figures |= {f"error/{k}": v for k, v in expected.errors.items()}
    assert list(compiled.figures) == list(figures)
    for values, (name, theirs) in zip(found.figures, figures.items(), strict=True):
        np.testing.assert_allclose(values, theirs, atol=1e-12, err_msg=name)
    assert list(compiled.flags) == [*(f"terminated/{k}" for k in expected.tests), "diverged"]
    rows = found.flags[compiled.flag_rows]
    np.testing.assert_array_equal(rows[:-1], list(expected.tests.values()))
    np.testing.assert_array_equal(found.terminated, np.any(list(expected.tests.values()), axis=0))
    assert not rows[-1].any()
    # Not everything passes, not everything fails, and there are contacts to count.
    lost = [found.terminated.any(), not found.terminated.all()]
    contacts = found.figures[compiled.figures.index("reward/contact")]
    assert all(lost) and len(np.unique(contacts)) > 1


def test_diverged_simulations_earn_nothing_and_are_terminated(case):
    _, compiled, s, model, rng = case
    history = sensor_history(model, len(s.rows), rng)
    diverged = np.arange(len(s.rows)) % 2 == 1
    found, well = (
        judge(compiled, s, history, False, d) for d in (diverged, np.zeros_like(diverged))
    )
    terms = [k for k, name in enumerate(compiled.figures) if name.startswith("reward/")]
    assert found.terminated[diverged].all() and not found.reward[diverged].any()
    assert not found.figures[terms][:, diverged].any()
    np.testing.assert_array_equal(found.reward[~diverged], well.reward[~diverged])
    np.testing.assert_array_equal(found.flags[4], diverged)


@pytest.mark.parametrize("share", [1.0, 0.25])
def test_observations_agree(case, share):
    plain, compiled, s, _, _ = case
    default = 0.01 * s.previous
    config = replace(plain.config, observation=replace(plain.config.observation, noise=None))
    quiet = TrackingTask(G1, config, s.library.has_object)
    rng = np.random.default_rng(5)
    expected = quiet.observe(s.qpos, s.qvel, s.bodies, s.frames, default, s.action, rng)
    noisy = plain.policy_layout.noise > 0 if plain.config.observation.noise else []
    ids = np.array([3, 7, 39])
    for some in (np.arange(40), ids):
        out = {k: np.full(v.shape, np.nan, np.float32) for k, v in named(expected).items()}
        critic = out.get("critic", np.empty((0, 0), np.float32))
        observe(compiled, s, default, share, some, out["policy"], critic)
        for name, values in named(expected).items():
            assert np.isnan(np.delete(out[name], some, axis=0)).all()
            error = np.abs(out[name][some] - values[some])
            bound = np.zeros(values.shape[1]) + 2e-6
            if name == "policy" and len(noisy):
                bound += share * plain.policy_layout.noise
                assert (error[:, noisy] > 0).all()
                # Of many uniform draws the largest comes close to the bound.
                largest = np.max(error / bound, where=noisy, initial=0.0)
                assert largest > (0.98 if len(some) == 40 else 0.9)
            assert (error <= bound).all(), name


def test_noise_does_not_depend_on_who_is_observed_beside(case):
    _, compiled, s, _, _ = case
    default, silence = np.zeros_like(s.action), np.empty((0, 0), np.float32)
    width = sum(t.slice.stop - t.slice.start for t in case[0].policy_layout.terms)
    one, all_ = np.zeros((2, 40, width), np.float32)
    observe(compiled, s, default, 1.0, np.array([7]), one, silence)
    observe(compiled, s, default, 1.0, np.arange(40), all_, silence)
    np.testing.assert_array_equal(one[7], all_[7])


def named(values):
    return values if isinstance(values, dict) else {"policy": values}


def test_observations_agree_in_double_precision(case):
    plain, compiled, s, _, _ = case
    default = 0.01 * s.previous
    policy, critic = (np.zeros((40, n.size)) for n in (plain.policy_layout, plain.critic_layout))
    observe(compiled, s, default, 0.0, np.arange(40), policy, critic)
    a, frames, has_object = plain.anchor, s.frames, s.frames.object_pose is not None
    state = observations.ObservedState(
        frames.qpos[:, 7:],
        frames.qvel[:, 6:],
        frames.bodies.position[:, a],
        frames.bodies.quaternion[:, a],
        s.bodies.position[:, a],
        s.bodies.quaternion[:, a],
        s.qpos[:, 3:7],
        s.qvel[:, :3],
        s.qvel[:, 3:6],
        s.qpos[:, 7:36] - default,
        s.qvel[:, 6:35],
        s.action,
        s.bodies,
        s.qpos[:, 36:] if has_object else None,
        s.qvel[:, 35:38] if has_object else None,
    )
    estimated = plain.config.observation.state_estimation
    expected = observations.policy_observation(state, estimated)
    np.testing.assert_allclose(policy, expected, atol=1e-12)
    np.testing.assert_allclose(critic, observations.critic_observation(state), atol=1e-12)


@pytest.mark.parametrize("share", [None, np.array([0.0, 0.4, 1.0])], ids=["all", "share"])
def test_start_states_agree(case, share):
    plain, compiled, s, _, rng = case
    ids = np.array([1, 2, 30])
    qpos, qvel = s.qpos.copy(), s.qvel.copy()
    simulation = SimpleNamespace(qpos=qpos, qvel=qvel, bodies=lambda: s.bodies)
    config = plain.config
    episodes = Episodes(s.library, G1.default_joint_array, 40, config, None)
    draws = np.random.default_rng(4).random((3, compiled.draws)).T.copy()
    critic = plain.critic_layout.size if config.observation.privileged else None
    out = empty_observations(40, plain.policy_layout.size, critic)
    episodes.rows[:] = s.rows + 1
    compiled.begin(simulation, episodes, ids, draws, share, rng, out)
    full = [part[ids] for part in plain.full_state(s.frames)]
    noise = plain.config.reset.noise
    rng = np.random.default_rng(4)
    expected = start_state(*full, noise, plain.soft_lower, plain.soft_upper, rng, share)
    np.testing.assert_allclose(qpos[ids], expected[0], atol=1e-12)
    np.testing.assert_allclose(qvel[ids], expected[1], atol=1e-12)
    others = np.setdiff1d(np.arange(40), ids)
    np.testing.assert_array_equal(qpos[others], s.qpos[others])
