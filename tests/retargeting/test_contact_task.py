import numpy as np
import pytest

from omni_envs.retargeting.contact_task import _FADES, _FULL, ContactTask, _Link, pull

DISTANCES = np.array([1e-4, 5e-3, _FULL, 0.03, _FADES, 0.2, 1.0])


def test_the_force_is_the_slope_of_the_loss():
    h = 1e-7
    share, _ = pull(DISTANCES)
    slope = (pull(DISTANCES + h)[1] - pull(DISTANCES - h)[1]) / (2 * h)
    np.testing.assert_allclose(share * DISTANCES, slope, rtol=1e-4)


def test_the_pull_is_full_at_a_centimetre_and_fades_out_of_reach():
    force = DISTANCES * pull(DISTANCES)[0]
    np.testing.assert_allclose(force[:2], DISTANCES[:2])
    np.testing.assert_allclose(force[2:5], _FULL)
    assert force[5] == pytest.approx(_FULL * 0.16) and force[6] < 0.01 * _FULL


def test_nothing_pulls_where_there_is_no_gap():
    share, loss = pull(np.zeros(1))
    assert np.isfinite(share).all() and loss[0] == pytest.approx(0.0, abs=1e-20)


def test_the_value_is_that_of_the_model(grasp, configuration, q):
    task = ContactTask(grasp, configuration, 60.0)
    configuration.update(q)
    assert task.value(configuration) == 0.0
    task.set_frame(50)
    assert task.value(configuration) == task.quadratic(configuration).value > 0.0


def test_contact_gap_is_to_the_surface_of_the_link(grasp, configuration, q):
    configuration.update(q)
    link = _Link(configuration, "left_hand")
    far = configuration.data.body("left_wrist_yaw_link").xpos.copy()
    far[2] += 1.0
    _, point, gap, _ = link.nearest(configuration, far)
    np.testing.assert_allclose(point + gap, far)
    assert 0.8 < np.linalg.norm(gap) < 1.0
    palm = configuration.data.geom("left_palm_hull").xpos
    _, _, inside, _ = link.nearest(configuration, palm)
    assert not inside.any()


@pytest.mark.parametrize("way", [(0.0, 0.0, 0.3), (0.3, 0.1, 0.0), (0.2, -0.3, 0.25)])
def test_contact_curvature_is_that_of_the_gap(configuration, q, way):
    """½‖gap‖² of a moving place has the curvature rootᵀ root, be it off face, edge or corner."""
    configuration.update(q)
    link = _Link(configuration, "left_hand")
    place = configuration.data.geom("left_palm_hull").xpos + way
    _, _, gap, root = link.nearest(configuration, place)
    assert np.linalg.norm(gap) > 0.05
    np.testing.assert_allclose(root @ gap, gap, atol=1e-12)

    def half_square(step):
        return 0.5 * np.sum(link.nearest(configuration, place + step)[2] ** 2)

    h, eye = 1e-4, np.eye(3)
    curvature = [
        [
            (
                half_square(h * (a + b))
                - half_square(h * (a - b))
                - half_square(h * (b - a))
                + half_square(-h * (a + b))
            )
            / (4 * h * h)
            for b in eye
        ]
        for a in eye
    ]
    np.testing.assert_allclose(root.T @ root, curvature, atol=1e-4)
