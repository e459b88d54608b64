import numpy as np
import pytest

from omni_envs.retargeting.contact_task import ContactTask, _Link


def test_the_value_is_that_of_the_model(grasp, configuration, q):
    task = ContactTask(grasp, configuration, 60.0)
    configuration.update(q)
    assert task.value(configuration) == 0.0
    task.set_frame(50)
    model = task.quadratic(configuration)
    assert task.value(configuration) == pytest.approx(model.value, rel=1e-12) and model.value > 0.0


def test_the_distance_is_to_the_surface_of_the_link(grasp, configuration, q):
    configuration.update(q)
    link = _Link(configuration, "left_hand")
    far = configuration.data.body("left_wrist_yaw_link").xpos.copy()
    far[2] += 1.0
    _, point, unit, distance, length, _ = link.nearest(configuration, far)
    np.testing.assert_allclose(point + distance * unit, far)
    assert 0.8 < distance < length < 1.0
    palm = configuration.data.geom("left_palm_hull").xpos
    _, point, _, distance, _, _ = link.nearest(configuration, palm)
    np.testing.assert_array_equal(point, palm)
    assert distance <= -0.01
