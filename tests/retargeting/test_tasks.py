"""Every task's model is the true value, gradient and (Gauss-Newton) curvature of its cost."""

import mink
import numpy as np
import pytest

from omni_envs.retargeting import InteractionMesh
from omni_envs.retargeting.contact_task import ContactTask
from omni_envs.retargeting.foothold_task import FootholdTask
from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.interaction_mesh_task import InteractionMeshTask
from omni_envs.retargeting.nominal_task import NominalTask, nominal_weights
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.orientation_task import OrientationTask
from omni_envs.retargeting.proximal_task import ProximalTask
from omni_envs.retargeting.sole_task import SoleTask
from omni_envs.retargeting.stance_plan import StancePlan
from omni_envs.robots import G1


def foothold_task():
    frames, feet = 1, 2
    plan = StancePlan(
        tier=np.zeros((frames, feet), int),
        turns=np.zeros((frames, feet), bool),
        rolls=np.zeros((frames, feet), bool),
        rise=np.zeros((frames, feet)),
        axes=np.zeros((frames, feet, 2, 3)),
        tips=np.zeros((frames, feet, 2)),
        tip_slack=np.zeros((frames, feet)),
        tip_step=np.zeros((frames, feet)),
        forward=np.array([[[1.0, 0.0], [0.6, 0.8]]]),
        arms=np.array([[[-0.1, 0.0], [-0.08, 0.02]]]),
        arm_weights=np.array([[[5.0, 7.0], [0.0, 3.0]]]),
    )
    return FootholdTask(plan)


def sole_task():
    up, downhill = np.array([np.sin(0.2), 0.0, np.cos(0.2)]), [np.cos(0.2), 0.0, -np.sin(0.2)]
    human = HumanFeet(
        pivots=np.zeros((1, 2), bool),
        rise=np.zeros((1, 2)),
        axes=np.array([[[downhill, np.cross(up, downhill)], np.eye(3)[:2]]]),
        support=np.array([[0.1, 0.05]]),
        flat=np.ones((1, 2), bool),
    )
    return SoleTask(human, 30.0, 20.0)


def tasks(grasp, configuration):
    mesh = InteractionMeshTask(InteractionMesh.of(grasp, 40), 10.0)
    mesh.set_frame(50)
    near = ProximalTask(np.linspace(0.1, 1.0, 35))
    near.set_target(G1.default_qpos)
    touch = ContactTask(grasp, configuration, 60.0)
    touch.set_frame(50)
    weights = nominal_weights(configuration, RetargetOptions(), 60, 30.0)
    nominal = NominalTask(np.tile(G1.default_qpos, (60, 1)), weights)
    nominal.set_frame(4)
    orientation = OrientationTask(grasp.keypoints, configuration, {"torso": 2.0, "hand": 3.0})
    orientation.set_frame(50)
    return {
        "mesh": mesh,
        "proximal": near,
        "contact": touch,
        "foothold": foothold_task(),
        "nominal": nominal,
        "orientation": orientation,
        "sole": sole_task(),
    }


@pytest.mark.parametrize(
    "name", ["mesh", "proximal", "contact", "foothold", "nominal", "orientation", "sole"]
)
def test_model(grasp, configuration, q, name):
    task = tasks(grasp, configuration)[name]
    configuration.update(q)
    model = task.quadratic(configuration)
    assert model is not None and model.value > 0
    H = np.diag(model.H) if model.H.ndim == 1 else model.H
    np.testing.assert_allclose(H, H.T, atol=1e-9)
    assert np.linalg.eigvalsh(H).min() > -1e-8
    step = 1e-5
    for i in range(35):
        dq = np.zeros(35)
        dq[i] = step
        values = []
        for sign in (1, -1):
            configuration.update(q)
            configuration.update(configuration.step(sign * dq))
            values.append(task.quadratic(configuration).value)
        assert model.g[i] == pytest.approx((values[0] - values[1]) / (2 * step), abs=2e-4)
    configuration.update(q)
    objective = task.compute_qp_objective(configuration)
    assert isinstance(objective, mink.Objective)
    np.testing.assert_array_equal(objective.H, H)


def test_tasks_that_are_off(grasp, configuration, q):
    configuration.update(q)
    touch, near = ContactTask(grasp, configuration, 60.0), ProximalTask(np.ones(35))
    for task in (touch, near):
        assert task.quadratic(configuration) is None
        assert not task.compute_qp_objective(configuration).H.any()
