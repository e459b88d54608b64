"""What a reference file leaves out, and how it comes back.

Velocities and the poses of bodies, nine tenths of a reference in memory, follow from ``qpos``: to
compute them takes half as long as to read them. All that is stored is stored exactly, measurements
too: the interaction mesh is a discontinuous function of the keypoints, so that single precision
changes figures of a report in the third digit.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omni_envs.references.kinematics import body_kinematics, generalized_velocities
from omni_envs.robots import get_robot, robot_names

VELOCITY = "qvel"
"""Array that follows from ``qpos`` and ``fps``."""

BODY_ARRAYS = (
    "body_positions",
    "body_quaternions",
    "body_linear_velocities",
    "body_angular_velocities",
)
"""Arrays that follow from ``qpos`` and ``qvel``."""

_SAME = 1e-9  # m, m/s, rad/s: above the rounding of another machine, below any use


def compact(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Returns the arrays of a reference without those that ``complete`` brings back.

    What does not follow stays: velocities that differ by a single bit, and bodies of a robot that
    is not registered or that are not where the simulator has them at (qpos, qvel).
    """
    kept = dict(arrays)
    computed = _bodies(kept)
    if computed and all(np.allclose(kept[n], computed[n], 0.0, _SAME) for n in BODY_ARRAYS):
        for name in BODY_ARRAYS:
            del kept[name]
    if np.array_equal(kept[VELOCITY], generalized_velocities(kept["qpos"], float(kept["fps"]))):
        del kept[VELOCITY]
    return kept


def complete(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Returns the arrays of a reference whole again.

    Where an array is no motion of the robot, nothing is computed from it: ``Reference`` then names
    what is wrong with it.
    """
    whole = dict(arrays)
    qpos, fps = (whole.get(key, np.zeros(0)) for key in ("qpos", "fps"))
    if VELOCITY not in whole:
        fit = _is_motion(qpos, qpos.shape) and qpos.ndim == 2 and qpos.shape[1] >= 7
        fit = fit and fps.ndim == 0 and fps.dtype.kind == "f"
        whole[VELOCITY] = generalized_velocities(qpos, float(fps)) if fit else np.zeros((0, 0))
    if not any(name in whole for name in BODY_ARRAYS):
        whole |= _bodies(whole) or dict.fromkeys(BODY_ARRAYS, np.zeros((0, 0, 0)))
    return whole


def _bodies(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The body arrays; none where robot, qpos and qvel do not allow to compute them."""
    name = str(arrays.get("robot"))
    if name not in robot_names():
        return {}
    robot = get_robot(name)
    qpos, qvel = (arrays.get(key, np.zeros(0)) for key in ("qpos", VELOCITY))
    frames = len(qpos) if qpos.ndim else 0
    if not _is_motion(qpos, (frames, robot.nq)) or not _is_motion(qvel, (frames, robot.nv)):
        return {}
    return dict(zip(BODY_ARRAYS, body_kinematics(robot.model, qpos, qvel), strict=True))


def _is_motion(array: np.ndarray, shape: tuple[int, ...]) -> bool:
    return array.shape == shape and array.dtype.kind == "f" and bool(np.isfinite(array).all())
