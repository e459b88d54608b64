import numpy as np
import pytest

from omni_envs.retargeting import RetargetOptions, deformation_energy, retarget
from omni_envs.retargeting.clip_program import ClipProgram
from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.interior_point import solve_clip_qp
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.sole_task import SoleTask
from omni_envs.retargeting.stance_plan import ANCHORED, stance_tiers
from omni_envs.retargeting.tangents import motion_steps, moved
from omni_envs.robots import G1

OPTIONS = RetargetOptions(contact_weight=0.0)
WEIGHT = 5e-6


@pytest.fixture(scope="module")
def motion(grasp, cut):
    return retarget(cut(grasp, 10, 34), G1, OPTIONS)


@pytest.fixture(scope="module")
def program(motion):
    return ClipProgram(motion.source, G1, OPTIONS, WEIGHT, motion.qpos)


def cost(motion, qpos):
    """The cost of the whole clip, from its definition."""
    metric = np.ones(G1.nv)
    metric[3:6] = 0.25
    steps = motion_steps(qpos)
    acceleration = np.diff(steps, axis=0) * motion.fps**2
    posture = sum(
        weight * np.square(qpos[:, 7 + G1.joint_names.index(joint)]).sum()
        for joint, weight in G1.posture_weights.items()
    )
    return 0.5 * (
        OPTIONS.laplacian_weight * deformation_energy(motion.source, G1, qpos, OPTIONS).sum()
        + OPTIONS.smoothness_weight * (metric * steps**2).sum()
        + WEIGHT * (metric * acceleration**2).sum()
        + posture
    ) + sum(soles(motion, qpos))


def soles(motion, qpos):
    standing = stance_tiers(motion.source, OPTIONS.stance) == ANCHORED
    task = SoleTask(HumanFeet.of(motion.source, standing), motion.fps, OPTIONS.sole_weight)
    configuration = Kinematics(G1, motion.source.scene)
    for t, q in enumerate(qpos):
        task.set_frame(t)
        configuration.update(q)
        yield task.quadratic(configuration).value


def test_steps_and_moves_are_inverse(motion):
    rng = np.random.default_rng(0)
    x = 0.1 * rng.normal(size=(len(motion.qpos), G1.nv))
    after = moved(motion.qpos, x)
    for q, p, tangent in zip(motion.qpos, after, x, strict=True):
        np.testing.assert_allclose(motion_steps(np.array([q, p]))[0], tangent, atol=1e-12)


def test_gradient_is_that_of_the_cost(motion, program):
    qp = program.linearise(motion.qpos, 0, motion.num_frames, 0.1)
    rng = np.random.default_rng(1)
    for _ in range(4):
        x = 1e-5 * rng.normal(size=qp.g.shape)
        change = cost(motion, moved(motion.qpos, x)) - cost(motion, moved(motion.qpos, -x))
        assert 2.0 * np.vdot(qp.g, x) == pytest.approx(change, rel=2e-2, abs=1e-9)


def test_a_solved_program_lowers_the_cost_as_foreseen(motion, program):
    qp = program.linearise(motion.qpos, 0, motion.num_frames, 0.02)
    x = solve_clip_qp(qp, 1e-7).x
    before, after = cost(motion, motion.qpos), cost(motion, moved(motion.qpos, x))
    assert after < before
    assert after - before == pytest.approx(qp.cost(x), rel=0.1)


def test_a_part_of_the_clip_is_the_clip_with_the_rest_held(motion, program):
    whole = program.linearise(motion.qpos, 0, motion.num_frames, 0.1)
    part = program.linearise(motion.qpos, 5, 15, 0.1)
    np.testing.assert_allclose(part.g, whole.g[5:15], atol=1e-9)
    x = np.zeros(whole.g.shape)
    x[5:15] = 1e-2 * np.random.default_rng(2).normal(size=(10, G1.nv))
    assert part.cost(x[5:15]) == pytest.approx(whole.cost(x))


def test_speed_limits_bind_only_where_the_box_reaches_them(motion, program):
    small = program.linearise(motion.qpos, 0, motion.num_frames, 1e-3)
    large = program.linearise(motion.qpos, 0, motion.num_frames, 10.0)
    assert not np.isfinite(small.change.lower).any()
    assert np.isfinite(large.change.lower[:, 6:]).all()
    assert not np.isfinite(large.change.lower[:, :6]).any()


def test_the_motion_itself_satisfies_its_constraints(motion, program):
    qp = program.linearise(motion.qpos, 0, motion.num_frames, 0.1)
    lower, upper, compliance = qp.limits()
    values = qp.values(np.zeros(qp.g.shape))
    hard = compliance == 0.0
    assert (values[hard] >= lower[hard]).all() and (values[hard] <= upper[hard]).all()
    assert np.maximum(lower - values, values - upper).max() <= 5e-4
