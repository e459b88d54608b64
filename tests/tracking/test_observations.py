import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.config import ObservationConfig, ObservationNoise
from omni_envs.tracking.observations import (
    ObservedState,
    critic_layout,
    critic_observation,
    policy_layout,
    policy_observation,
)

N, JOINTS, BODIES = 5, 29, 14
ORDER = (
    "command", "motion_anchor_pos_b", "motion_anchor_ori_b", "base_lin_vel",
    "base_ang_vel", "joint_pos", "joint_vel", "actions",
)  # fmt: skip


@pytest.mark.parametrize(
    ("joints", "full", "blind"), [(29, 160, 154), (19, 110, 104), (23, 130, 124)]
)
def test_sizes_with_and_without_state_estimation(joints, full, blind):
    assert policy_layout(ObservationConfig(), joints).size == full
    assert policy_layout(ObservationConfig(state_estimation=False), joints).size == blind


def test_order_and_slices():
    layout = policy_layout(ObservationConfig(), 29)
    assert layout.names == ORDER
    ends = [t.slice.stop for t in layout.terms]
    assert ends == [58, 61, 67, 70, 73, 102, 131, 160]
    blind = policy_layout(ObservationConfig(state_estimation=False), 29)
    assert blind.names == tuple(
        n for n in ORDER if n not in ("motion_anchor_pos_b", "base_lin_vel")
    )


def test_critic_sizes():
    assert critic_layout(29, 14, has_object=False).size == 286
    assert critic_layout(29, 14, has_object=True).size == 298
    assert not critic_layout(29, 14, True).noise.any()


def test_noise_is_on_the_measured_terms_only():
    noise = ObservationNoise(anchor_position=0.25)
    layout = policy_layout(ObservationConfig(noise=noise), 29)
    widths = {t.name: layout.noise[t.slice] for t in layout.terms}
    expected = dict(zip(ORDER, (0, 0.25, 0.05, 0.5, 0.2, 0.01, 0.5, 0), strict=True))
    for name, value in expected.items():
        np.testing.assert_allclose(widths[name], value, err_msg=name)
    assert not policy_layout(ObservationConfig(noise=None), 29).noise.any()


@pytest.fixture
def state():
    rng = np.random.default_rng(0)

    def q(count, seed):
        return Rotation.random(count, random_state=seed).as_quat(scalar_first=True)

    return ObservedState(
        reference_joint_position=rng.normal(size=(N, JOINTS)),
        reference_joint_velocity=rng.normal(size=(N, JOINTS)),
        reference_anchor_position=rng.normal(size=(N, 3)),
        reference_anchor_quaternion=q(N, 1),
        anchor_position=rng.normal(size=(N, 3)),
        anchor_quaternion=q(N, 2),
        base_quaternion=q(N, 3),
        base_linear_velocity=rng.normal(size=(N, 3)),
        base_angular_velocity=rng.normal(size=(N, 3)),
        joint_position=rng.normal(size=(N, JOINTS)),
        joint_velocity=rng.normal(size=(N, JOINTS)),
        action=rng.normal(size=(N, JOINTS)),
        bodies=Bodies(
            rng.normal(size=(N, BODIES, 3)),
            q(N * BODIES, 4).reshape(N, BODIES, 4),
            rng.normal(size=(N, BODIES, 3)),
            rng.normal(size=(N, BODIES, 3)),
        ),
        object_pose=np.concatenate([rng.normal(size=(N, 3)), q(N, 5)], axis=1),
        object_linear_velocity=rng.normal(size=(N, 3)),
    )


def rotation(q):
    return Rotation.from_quat(q, scalar_first=True)


def columns(r):
    return r.as_matrix()[:, :, :2].reshape(len(r), 6)


def test_values_of_every_policy_term(state):
    at = policy_layout(ObservationConfig(), JOINTS).slices
    seen = policy_observation(state)
    anchor, base = rotation(state.anchor_quaternion), rotation(state.base_quaternion)
    relative = anchor.inv() * rotation(state.reference_anchor_quaternion)
    offset = state.reference_anchor_position - state.anchor_position
    expected = {
        "command": np.concatenate(
            [state.reference_joint_position, state.reference_joint_velocity], axis=1
        ),
        "motion_anchor_pos_b": anchor.inv().apply(offset),
        "motion_anchor_ori_b": columns(relative),
        "base_lin_vel": base.inv().apply(state.base_linear_velocity),
        "base_ang_vel": state.base_angular_velocity,
        "joint_pos": state.joint_position,
        "joint_vel": state.joint_velocity,
        "actions": state.action,
    }
    for name, value in expected.items():
        np.testing.assert_allclose(seen[:, at[name]], value, atol=1e-12, err_msg=name)


def test_masking_deletes_terms(state):
    at = policy_layout(ObservationConfig(), JOINTS).slices
    kept = np.ones(160, bool)
    kept[at["motion_anchor_pos_b"]] = kept[at["base_lin_vel"]] = False
    blind = policy_observation(state, state_estimation=False)
    np.testing.assert_array_equal(blind, policy_observation(state)[:, kept])


def test_values_of_every_critic_term(state):
    at = critic_layout(JOINTS, BODIES, True).slices
    seen = critic_observation(state)
    assert seen.shape == (N, 298)
    np.testing.assert_array_equal(seen[:, :160], policy_observation(state))
    anchor = rotation(state.anchor_quaternion)
    for b in range(BODIES):
        arm = state.bodies.position[:, b] - state.anchor_position
        relative = anchor.inv() * rotation(state.bodies.quaternion[:, b])
        position = seen[:, at["body_pos_b"]].reshape(N, BODIES, 3)[:, b]
        orientation = seen[:, at["body_ori_b"]].reshape(N, BODIES, 6)[:, b]
        np.testing.assert_allclose(position, anchor.inv().apply(arm), atol=1e-12)
        np.testing.assert_allclose(orientation, columns(relative), atol=1e-12)
    pose = state.object_pose
    np.testing.assert_allclose(
        seen[:, at["obj_pos_b"]],
        anchor.inv().apply(pose[:, :3] - state.anchor_position),
        atol=1e-12,
    )
    np.testing.assert_allclose(
        seen[:, at["obj_ori_b"]], columns(anchor.inv() * rotation(pose[:, 3:])), atol=1e-12
    )
    # A velocity is rotated; it is not moved to another origin.
    np.testing.assert_allclose(
        seen[:, at["obj_lin_vel_b"]],
        anchor.inv().apply(state.object_linear_velocity),
        atol=1e-12,
    )


def test_numpy_and_torch_agree(state):
    torch = pytest.importorskip("torch")
    tensors = ObservedState(
        *(
            Bodies(*map(torch.as_tensor, part))
            if isinstance(part, Bodies)
            else torch.as_tensor(part)
            for part in state
        )
    )
    for observe in (policy_observation, critic_observation):
        np.testing.assert_allclose(observe(tensors).numpy(), observe(state), atol=1e-12)
