import dataclasses

import numpy as np
import pytest

from omni_envs.errors import InvalidDataError
from omni_envs.robots import G1
from omni_envs.tracking.motion import MotionLibrary


def test_frames_are_those_of_the_references(sway):
    first, second = sway(120), sway(60)
    library = MotionLibrary(G1, [first, second], 50.0)
    assert library.lengths.tolist() == [120, 60]
    assert library.starts.tolist() == [0, 120]
    index = np.array([5, 0, 119, 120, 179])
    frames = library.frames(index)
    tracked = first.body_indices(G1.tracked_bodies)
    for row, (reference, frame) in enumerate(
        [(first, 5), (first, 0), (first, 119), (second, 0), (second, 59)]
    ):
        np.testing.assert_array_equal(frames.qpos[row], reference.qpos[frame])
        np.testing.assert_array_equal(frames.qvel[row], reference.qvel[frame])
        for mine, name in zip(
            frames.bodies,
            ("positions", "quaternions", "linear_velocities", "angular_velocities"),
            strict=True,
        ):
            expected = getattr(reference, f"body_{name}")[frame, tracked]
            np.testing.assert_array_equal(mine[row], expected)
        np.testing.assert_array_equal(frames.object_pose[row], reference.object_poses[frame])
        np.testing.assert_array_equal(
            frames.object_velocity[row], reference.object_velocities[frame]
        )


def test_without_object(sway):
    frames = MotionLibrary(G1, [sway(with_object=False)], 50.0).frames(np.array([3]))
    assert frames.object_pose is None
    assert frames.object_velocity is None


def test_bad_references(sway):
    good = sway()
    with pytest.raises(InvalidDataError, match="at least one reference"):
        MotionLibrary(G1, [], 50.0)
    with pytest.raises(InvalidDataError, match="3 frames at least; got 2"):
        MotionLibrary(G1, [sway(2)], 50.0)
    with pytest.raises(InvalidDataError, match="fps must be 25, the control rate; got 50"):
        MotionLibrary(G1, [good], 25.0)
    with pytest.raises(InvalidDataError, match="in all references or in none"):
        MotionLibrary(G1, [good, sway(with_object=False)], 50.0)
    other = dataclasses.replace(G1, name="other")
    with pytest.raises(InvalidDataError, match=r"robot must be 'other'; got 'g1'"):
        MotionLibrary(other, [good], 50.0)
