import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from omni_envs.envs import OmniVectorEnv
from omni_envs.envs.task import TrackingTask
from omni_envs.errors import InvalidDataError, InvalidOptionError, UnknownNameError
from omni_envs.tracking.feedforward import feedforward_lead

ACTIONS = np.random.default_rng(0).normal(size=(40, 4, 29)) * 0.5


def rollout(env, actions, seed=3):
    observations, _ = env.reset(seed=seed)
    return [(observations,), *(env.step(action)[:4] for action in actions)]


def identical(a, b):
    for x, y in zip(a, b, strict=True):
        for u, v in zip(x, y, strict=True):
            np.testing.assert_array_equal(u, v)


def test_shapes_types_and_spaces(make):
    env = make()
    observations, infos = env.reset(seed=0)
    assert observations.shape == (4, 160)
    assert observations.dtype == np.float32
    assert env.observation_space.contains(observations)
    assert env.action_space.shape == (4, 29)
    assert env.single_action_space.low.min() == -10
    observations, reward, terminated, truncated, infos = env.step(ACTIONS[0])
    assert reward.shape == terminated.shape == truncated.shape == (4,)
    assert terminated.dtype == truncated.dtype == bool
    for key, value in infos.items():
        if not key.startswith("_"):
            assert value.shape == (4,), key
            assert infos[f"_{key}"].dtype == bool


def test_the_same_seed_and_actions_are_bit_identical_at_any_thread_count(make):
    one = rollout(make(num_threads=1), ACTIONS)
    identical(one, rollout(make(num_threads=2), ACTIONS))
    identical(one, rollout(make(num_threads=3), ACTIONS))


def test_many_simulations_share_the_threads_and_are_bit_identical(make):
    actions = np.random.default_rng(0).normal(size=(20, 100, 29)) * 0.5
    runs = []
    for threads in (1, 2, 3):
        env = make(
            100,
            num_threads=threads,
            observation={"privileged": True},
            termination={"max_seconds": 0.2, "end_effector_height": 0.05},
        )
        env.reset(seed=3)
        steps = [env.step(action) for action in actions]
        assert any(step[2].any() for step in steps) and any(step[3].any() for step in steps)
        runs.append([(o["policy"], o["critic"], *others) for o, *others, _ in steps])
    for run in runs[1:]:
        identical(runs[0], run)


def test_a_seeded_reset_repeats_everything(make):
    env = make(preset="beyondmimic")
    first = rollout(env, ACTIONS)
    identical(first, rollout(env, ACTIONS))
    other = rollout(env, ACTIONS, seed=4)
    assert not np.array_equal(first[0][0], other[0][0])


def test_an_unseeded_reset_goes_on_with_the_same_stream(make):
    env = make()
    a, _ = env.reset(seed=0)
    b, _ = env.reset()
    assert not np.array_equal(a, b)


def test_observations_are_not_reused(make):
    env = make()
    a, _ = env.reset(seed=0)
    kept = a.copy()
    b = env.step(ACTIONS[0])[0]
    assert not np.shares_memory(a, b)
    np.testing.assert_array_equal(a, kept)


def test_same_step_hands_out_the_last_observation(make, quiet):
    """Runs two environments alike until one simulation ends; only one resets it."""
    same, wait = make(**quiet), make(**quiet, autoreset_mode="DISABLED")
    for env in (same, wait):
        env.reset(seed=1)
    for action in ACTIONS:
        ours = same.step(action)
        theirs = wait.step(action)
        done = ours[2] | ours[3]
        np.testing.assert_array_equal(done, theirs[2] | theirs[3])
        np.testing.assert_array_equal(ours[1], theirs[1])
        if done.any():
            break
    else:
        pytest.fail("No episode ended.")
    infos = ours[4]
    np.testing.assert_array_equal(infos["_final_obs"], done)
    np.testing.assert_array_equal(infos["_final_info"], done)
    for i in range(4):
        if done[i]:
            np.testing.assert_array_equal(infos["final_obs"][i], theirs[0][i])
            assert not np.array_equal(ours[0][i], theirs[0][i])
        else:
            assert infos["final_obs"][i] is None
            np.testing.assert_array_equal(ours[0][i], theirs[0][i])
    for key, value in theirs[4].items():
        if not key.startswith("_"):
            np.testing.assert_array_equal(infos["final_info"][key][done], value[done])
            np.testing.assert_array_equal(infos["final_info"][f"_{key}"], done)


def test_disabled_waits_for_the_mask(make):
    env = make(autoreset_mode=AutoresetMode.DISABLED)
    assert env.metadata["autoreset_mode"] is env.autoreset_mode is AutoresetMode.DISABLED
    observations, _ = env.reset(seed=1)
    mask = np.array([False, True, False, True])
    before = env.simulation.qpos.copy()
    after, _ = env.reset(options={"reset_mask": mask})
    np.testing.assert_array_equal(after[~mask], observations[~mask])
    np.testing.assert_array_equal(env.simulation.qpos[~mask], before[~mask])
    assert (after[mask] != observations[mask]).any(axis=1).all()
    _, _, _, _, infos = env.step(ACTIONS[0])
    assert "final_obs" not in infos


def test_an_episode_that_nobody_resets_counts_once(make):
    env = make(autoreset_mode="DISABLED", reset={"start": "adaptive"})
    env.reset(seed=1)
    nothing = np.full((4, 29), np.nan)
    assert all(env.step(nothing)[2].all() for _ in range(4))
    once = 4 * (1.0 - env.config.reset.adaptive.decay)
    assert env.sampler.failures.sum() == pytest.approx(once, rel=0.01)
    env.reset(options={"reset_mask": np.array([True, False, False, False])})
    env.step(nothing)
    assert env.sampler.failures.sum() == pytest.approx(1.25 * once, rel=0.01)


def test_a_reset_mask_leaves_the_others_course_alone(make, quiet):
    a, b = (make(**quiet, autoreset_mode="DISABLED") for _ in range(2))
    for env in (a, b):
        env.reset(seed=1, options={"frame": 5})
        env.step(ACTIONS[0] * 0)
    b.reset(options={"reset_mask": np.array([True, False, False, False])})
    ours, theirs = a.step(ACTIONS[1]), b.step(ACTIONS[1])
    for x, y in zip(ours[:4], theirs[:4], strict=True):
        np.testing.assert_array_equal(x[1:], y[1:])


def test_bad_masks(make):
    env = make(autoreset_mode="disabled")
    with pytest.raises(InvalidOptionError, match="first reset"):
        env.reset(options={"reset_mask": np.array([True, False, False, False])})
    env.reset()
    for mask in ([True] * 3, [1, 0, 0, 0]):
        with pytest.raises(InvalidOptionError, match=r"reset_mask must be \(4,\) bool"):
            env.reset(options={"reset_mask": np.array(mask)})


def test_reset_options_that_do_not_exist_are_refused(make):
    with pytest.raises(UnknownNameError, match=r"reset option 'start'.*frame, motion, reset_mask"):
        make().reset(options={"start": 3})


def test_an_empty_mask_changes_nothing(make):
    env = make(autoreset_mode="DISABLED")
    before, _ = env.reset(seed=0)
    after, _ = env.reset(options={"reset_mask": np.zeros(4, bool)})
    np.testing.assert_array_equal(after, before)


def test_truncation_at_the_end_of_the_motion(make, quiet):
    # Held on the reference by nothing but generous tests.
    never = {"anchor_height": None, "anchor_tilt": None, "end_effector_height": None}
    never |= {"object_position": None, "object_angle": None}
    env = make(2, **quiet, termination=never)
    env.reset(seed=0, options={"frame": [110, 117]})
    ends = []
    for step in range(1, 10):
        _, _, terminated, truncated, infos = env.step(np.zeros((2, 29)))
        assert not terminated.any()
        ends += [(i, step, int(infos["final_info"]["frame"][i])) for i in np.flatnonzero(truncated)]
    # From frame 117 on: 118 and 119 are tracked, 119 is the last.
    assert ends[0] == (1, 2, 119)
    assert (0, 9, 119) in ends


def test_time_out(make, quiet):
    env = make(1, **quiet, termination={"max_seconds": 0.06, "end_effector_height": None})
    env.reset(seed=0, options={"frame": 0})
    assert [bool(env.step(np.zeros((1, 29)))[3][0]) for _ in range(3)] == [False, False, True]
    env = make(1, **quiet, max_episode_steps=2)
    env.reset(seed=0, options={"frame": 0})
    assert [bool(env.step(np.zeros((1, 29)))[3][0]) for _ in range(2)] == [False, True]


def test_the_policy_sees_the_frame_that_it_is_judged_against(make, quiet, reference):
    env = make(1, **quiet)
    observations, infos = env.reset(seed=0, options={"frame": 40})
    assert infos["frame"].tolist() == [41]
    command = observations[0, env.policy_layout.slices["command"]]
    expected = np.concatenate([reference.joint_positions[41], reference.joint_velocities[41]])
    np.testing.assert_allclose(command, expected, rtol=1e-6)
    # The simulation itself is in frame 40.
    np.testing.assert_array_equal(env.simulation.qpos[0, :36], reference.qpos[40])
    _, _, _, _, infos = env.step(np.zeros((1, 29)))
    error = np.linalg.norm(env.simulation.qpos[0, :3] - reference.qpos[41, :3])
    np.testing.assert_allclose(infos["error/anchor_position"], error, rtol=1e-9)


@pytest.mark.parametrize("preset", ["paper", "beyondmimic"])
def test_no_start_is_lost_already(make, preset):
    """Every frame, with reset noise: the first step must not end for where it started."""
    env = make(118 * 3, preset=preset, termination={"object_after": 0.0})
    frames = np.tile(np.arange(118), 3)
    env.reset(seed=0, options={"frame": frames})
    task, library = TrackingTask(env.robot, env.config, True), env._library
    action = np.zeros((len(frames), 29))
    judged = task.judge(
        env.simulation.qpos,
        env.simulation.bodies(),
        library.frames(frames),
        action,
        action,
        np.zeros((len(frames), 1, 4, 3)),
        True,
    )
    for name, lost in judged.tests.items():
        assert not lost.any(), name


def test_residual_actions_are_about_the_reference(make, quiet, reference):
    env = make(1, **quiet, action={"mode": "residual"})
    env.reset(seed=0, options={"frame": 20})
    env.step(np.zeros((1, 29)))
    np.testing.assert_allclose(env.simulation.ctrl[0], reference.joint_positions[21], atol=1e-12)
    env.reset(seed=0, options={"frame": 20})
    env.step(np.full((1, 29), 0.5))
    expected = reference.joint_positions[21] + 0.5 * env.robot.action_scale
    np.testing.assert_allclose(env.simulation.ctrl[0], expected, atol=1e-12)


def test_feedforward_actions_are_about_targets_ahead_of_the_reference(make, quiet, reference):
    env = make(1, **quiet, action={"mode": "feedforward"})
    env.reset(seed=0, options={"frame": 20})
    env.step(np.full((1, 29), 0.5))
    target = reference.joint_positions[21] + feedforward_lead(env.robot, reference)[21]
    np.testing.assert_allclose(
        env.simulation.ctrl[0], target + 0.5 * env.robot.action_scale, atol=1e-12
    )
    standard = make(1, **quiet, action={"limit": 1e3})
    action = (env.simulation.ctrl - env.robot.default_joint_array) / env.robot.action_scale
    standard.reset(seed=0, options={"frame": 20})
    seen, reward, *_ = standard.step(action)
    env.reset(seed=0, options={"frame": 20})
    seen_again, reward_again, *_ = env.step(np.full((1, 29), 0.5))
    np.testing.assert_allclose(
        seen_again, seen, atol=1e-6
    )  # the previous action is the standard one
    np.testing.assert_allclose(reward_again, reward, atol=1e-12)


def test_default_actions_are_about_the_default_pose(make, quiet):
    env = make(1, **quiet)
    env.reset(seed=0)
    env.step(np.full((1, 29), 2.0))
    expected = env.robot.default_joint_array + 2.0 * env.robot.action_scale
    np.testing.assert_allclose(env.simulation.ctrl[0], expected)
    env.step(np.full((1, 29), 1e6))  # clipped to the action space
    limit = env.robot.default_joint_array + 10.0 * env.robot.action_scale
    np.testing.assert_allclose(env.simulation.ctrl[0], limit)


def test_pushes_add_to_the_velocity_of_the_root(make, quiet):
    options = {**quiet, "randomization": {**quiet["randomization"], "push": {}}}
    pushed, calm = make(2, **options), make(2, **quiet)
    for env in (pushed, calm):
        env.reset(seed=0, options={"frame": 3})
    pushed._episodes.clocks.next_push[:] = [1, 99]
    action = np.zeros((2, 29))
    pushed.step(action), calm.step(action)
    change = pushed.simulation.qvel - calm.simulation.qvel
    assert (change[0, :6] != 0).all()
    assert np.abs(change[0, :3]).max() <= 0.3
    assert not change[0, 6:].any()
    assert not change[1].any()


def test_an_object_far_away_ends_the_episode_once_the_gate_is_open(make, quiet):
    for after, ends in ((0.0, True), (0.5, False)):
        env = make(2, **quiet, termination={"object_after": after})
        env.reset(seed=0, options={"frame": 3})
        assert env.object_test_active is ends
        env.simulation.qpos[0, 36] += 1.5
        _, _, terminated, _, infos = env.step(np.zeros((2, 29)))
        assert terminated.tolist() == [ends, False]
        assert infos["terminated/object"].tolist() == [ends, False]


def test_nan_actions_end_their_own_episode_only(make):
    env, twin = make(), make()
    for e in (env, twin):
        e.reset(seed=0)
    bad = ACTIONS[0].copy()
    bad[2, 5], bad[3, 0] = np.nan, np.inf
    observations, reward, terminated, _, infos = env.step(bad)
    _, expected, _, _, _ = twin.step(ACTIONS[0])
    assert infos["diverged"].tolist() == [False, False, True, True]
    assert terminated[2:].all()
    assert np.isfinite(observations).all()
    assert reward[2:].tolist() == [0.0, 0.0]
    np.testing.assert_array_equal(reward[:2], expected[:2])


def test_an_explosion_ends_its_own_episode_only(make, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # MuJoCo logs the warning into the working directory
    env, twin = make(), make()
    for e in (env, twin):
        e.reset(seed=0)
    env.simulation.qvel[1, 8] = 1e11
    state = env.simulation.qpos[1].copy()
    observations, reward, terminated, _, infos = env.step(ACTIONS[0])
    _, expected, _, _, _ = twin.step(ACTIONS[0])
    assert infos["diverged"].tolist() == [False, True, False, False]
    assert terminated[1]
    assert reward[1] == 0
    assert np.isfinite(observations).all()
    assert np.isfinite(infos["final_obs"][1]).all()
    others = [0, 2, 3]
    np.testing.assert_array_equal(reward[others], expected[others])
    (record,) = env.divergences
    assert record.simulation == 1
    np.testing.assert_array_equal(record.qpos, state)
    with np.load(record.save(tmp_path / "dump.npz"), allow_pickle=False) as saved:
        assert saved["qvel"][8] == 1e11
    assert not env.step(ACTIONS[1])[4]["diverged"].any()


def test_privileged_observations(make):
    env = make(observation={"privileged": True})
    observations, _ = env.reset(seed=0)
    assert env.observation_space.contains(observations)
    assert {k: v.shape for k, v in observations.items()} == {
        "policy": (4, 160),
        "critic": (4, 298),
    }
    for action in ACTIONS:
        observations, *_, infos = env.step(action)
        if "final_obs" in infos:
            break
    i = int(np.flatnonzero(infos["_final_obs"])[0])
    final = infos["final_obs"][i]
    assert final["policy"].shape == (160,)
    assert not np.array_equal(final["critic"], observations["critic"][i])


def test_without_state_estimation_and_without_object(make, sway):
    env = make(reference=sway(with_object=False), observation={"state_estimation": False})
    observations, _ = env.reset(seed=0)
    assert observations.shape == (4, 154)
    assert env.critic_layout.size == 286
    _, _, _, _, infos = env.step(ACTIONS[0])
    assert not any("object" in key for key in infos)


def test_several_motions(make, sway, reference):
    env = make(60, reference=[reference, sway(60)])
    env.reset(seed=0)
    _, _, _, _, infos = env.step(np.zeros((60, 29)))
    assert set(infos["motion"]) == {0, 1}
    _, infos = env.reset(options={"motion": 1, "frame": 58})
    assert infos["motion"].tolist() == [1] * 60
    with pytest.raises(InvalidOptionError, match="frame from 0 to the last but one"):
        env.reset(options={"motion": 1, "frame": 59})
    with pytest.raises(InvalidOptionError, match="whole numbers"):
        env.reset(options={"frame": 1.5})
    with pytest.raises(InvalidOptionError, match="motion must be below 2"):
        env.reset(options={"motion": 2})


def test_every_motion_has_its_own_scene(make, sway, quiet):
    small, large = sway(half=0.10), sway(half=0.20)
    env = make(40, **quiet, reference=[small, large, small])
    assert len(env.scenes) == 2
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros((40, 29)))
    motions = env.reset(seed=1)[1]["motion"]
    assert set(motions) == {0, 1, 2}
    for i in range(40):
        model = env.simulation.model_of(i)
        size = model.geom_size[model.geom("object_0").id]
        np.testing.assert_allclose(size, 0.2 if motions[i] == 1 else 0.1)


def test_scenes_and_randomization_go_together(make, sway):
    env = make(200, reference=[sway(half=0.10), sway(half=0.20)])
    motions = env.reset(seed=1)[1]["motion"]
    sizes = np.array(
        [m.geom_size[m.geom("object_0").id] for m in map(env.simulation.model_of, range(200))]
    )
    half = np.where(motions == 1, 0.2, 0.1)[:, None]
    assert (np.abs(sizes / half - 1) <= 0.1 + 1e-9).all()
    assert len(np.unique(sizes[:, 0])) > 60


def test_scenes_of_another_layout_are_refused(make, sway, reference):
    with pytest.raises(InvalidDataError, match="same kinds and numbers of shapes"):
        make(reference=[reference, sway(mesh=True)])


def test_bad_options(reference):
    def make(**options):
        return OmniVectorEnv(2, reference=reference, **options)

    with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'"):
        make(frameskip=4)
    with pytest.raises(InvalidOptionError, match=r"'rewards'\. Did you mean 'reward'\? Valid: act"):
        make(rewards={})
    with pytest.raises(UnknownNameError, match=r"reward option 'body_pos'.*Valid: action_rate"):
        make(reward={"body_pos": 1})
    with pytest.raises(UnknownNameError, match="autoreset mode 'NEXT_STEP'"):
        make(autoreset_mode=AutoresetMode.NEXT_STEP)
    with pytest.raises(UnknownNameError, match="robot"):
        make(robot="c3po")
    with pytest.raises(InvalidOptionError, match="render_mode"):
        make(render_mode="human")
    with pytest.raises(InvalidOptionError, match="num_envs"):
        OmniVectorEnv(0, reference=reference)
    with pytest.raises(InvalidOptionError, match="num_threads must be at least 0; got -1"):
        make(num_threads=-1)
    with pytest.raises(InvalidOptionError, match="max_episode_steps"):
        make(max_episode_steps=0)
    for name in ("num_threads", "max_episode_steps", "width", "height"):
        for value in (1.5, "2", True):
            with pytest.raises(InvalidOptionError, match=f"{name} must be a whole number; got"):
                make(**{name: value})
    with pytest.raises(InvalidOptionError, match=r"num_envs must be a whole number; got 1\.5"):
        OmniVectorEnv(1.5, reference=reference)
    with pytest.raises(InvalidOptionError, match="width must be at least 1; got 0"):
        make(width=0)
    with pytest.raises(InvalidDataError, match="fps"):
        make(physics={"substeps": 5})
    with pytest.raises(InvalidOptionError, match="reference: expected a path"):
        OmniVectorEnv(1, reference=3)
    with pytest.raises(InvalidOptionError, match="variants"):
        make(randomization={"variants": 0})


def test_bad_actions(make):
    env = make()
    with pytest.raises(InvalidOptionError, match="call reset first"):
        env.step(ACTIONS[0])
    env.reset()
    with pytest.raises(InvalidDataError, match=r"actions must be \(4, 29\); got \(4, 28\)"):
        env.step(np.zeros((4, 28)))
    with pytest.raises(InvalidDataError, match="actions must be real numbers; got str"):
        env.step("stand up")


def test_bad_resets(make):
    env = make()
    for seed in (-1, [1, 2], [0.5] * 4, "zero"):
        with pytest.raises(InvalidOptionError, match="one for each of the 4 simulations; got"):
            env.reset(seed=seed)
    with pytest.raises(InvalidOptionError, match="options must be a mapping or None; got 5"):
        env.reset(options=5)
    with pytest.raises(InvalidOptionError, match=r"frame must be one for all, .* got shape \(2,\)"):
        env.reset(options={"frame": [1, 2]})


def test_a_list_of_no_seeds_goes_on_with_the_chance_there_is(make):
    env = make()
    frames = [env.reset(seed=[None] * 4)[1]["frame"].tolist() for _ in range(4)]
    assert len({tuple(f) for f in frames}) > 1
    again = [env.reset(seed=[1, None, 2, 3])[0] for _ in range(2)]
    np.testing.assert_array_equal(*again)


def test_picture_with_ghost(make, quiet):
    env = make(1, **quiet, render_mode="rgb_array", width=160, height=120)
    env.reset(seed=0, options={"frame": 10})
    try:
        (picture,) = env.render()
    except Exception as error:  # no graphics on this machine
        pytest.skip(f"cannot render here: {error}")
    assert picture.shape == (120, 160, 3)
    assert picture.dtype == np.uint8
    assert picture.std() > 5
    assert make(1).render() is None


def test_memory_does_not_grow(make):
    import tracemalloc

    env = make(8)
    env.reset(seed=0)
    actions = np.zeros((8, 29))
    for _ in range(60):
        env.step(actions)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(200):
        env.step(actions)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 100_000


@pytest.mark.parametrize(
    "options",
    [
        {"physics": "fast"},
        {"reward": {"contact_rule": "substeps"}},
        {"reward": {"contact_rule": "any"}},
        {"preset": "beyondmimic"},
        {"randomization": {"object": None}},
        {"reset": {"start": "adaptive"}},
        {"reset": {"start": "start"}},
    ],
    ids=str,
)
def test_other_options_run(make, options):
    env = make(**options)
    env.reset(seed=0)
    for action in ACTIONS[:15]:
        observations, reward, *_ = env.step(action)
        assert np.isfinite(observations).all()
        assert np.isfinite(reward).all()
        assert (reward <= 7.0 * 0.02 + 1e-9).all()


def test_resting_on_the_knee_costs_only_under_the_rule_any(make, quiet):
    """A lying robot: every contact counts for BeyondMimic, none for OmniRetarget."""
    never = {"anchor_height": None, "anchor_tilt": None, "end_effector_height": None}
    penalties = {}
    for rule in ("self", "any"):
        env = make(1, **quiet, reward={"contact_rule": rule}, termination=never)
        env.reset(seed=0, options={"frame": 0})
        env.simulation.qpos[0, :7] = [0, 0, 0.2, np.sqrt(0.5), 0, np.sqrt(0.5), 0]
        for _ in range(25):
            infos = env.step(np.zeros((1, 29)))[4]
        penalties[rule] = infos["reward/contact"][0]
    assert penalties["self"] == 0
    assert penalties["any"] <= -2 * 0.1 * 0.02


def test_start_noise_grows_in_the_environment(make, quiet):
    reset = {"noise": {}, "growth": {"share": 0.0, "step": 0.5}}
    env = make(8, **{**quiet, "reset": reset}, max_episode_steps=2)
    still = make(8, **quiet)
    env.reset(seed=0, options={"frame": 5})
    still.reset(seed=0, options={"frame": 5})
    np.testing.assert_array_equal(env.simulation.qpos, still.simulation.qpos)
    assert env.noise_level == 0.0
    for _ in range(60):  # 30 episodes per simulation
        env.step(np.zeros((8, 29)))
    assert env.noise_level == 1.0
    env.reset(options={"frame": 5})
    assert (env.simulation.qpos[:, :3] != still.simulation.qpos[:, :3]).all()
    env.reset(seed=0)
    assert env.noise_level == 0.0


@pytest.mark.parametrize("observation", [False, True])
def test_observation_noise_grows_where_asked_to(make, quiet, observation):
    growth = {"share": 0.0, "step": 0.5, "observation": observation}
    options = {**quiet, "observation": {"noise": {}, "privileged": True}}
    env = make(8, **{**options, "reset": {"noise": None, "growth": growth}}, max_episode_steps=2)

    def noise():
        seen, _ = env.reset(options={"frame": 5})
        return np.abs(seen["policy"] - seen["critic"][:, :160]).max()

    env.reset(seed=0)
    assert noise() == 0.0 if observation else noise() > 0.4
    for _ in range(30):
        env.step(np.zeros((8, 29)))
    assert env.noise_level == 0.5
    assert 0.2 < noise() <= 0.25 if observation else noise() > 0.4
    for _ in range(30):
        env.step(np.zeros((8, 29)))
    assert 0.4 < noise() <= 0.5
