"""The built-in climb: up a platform of 70 % of the body's height with the hands, and down again."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.climb_plan import PLATFORM, plan_ascent
from omni_envs.demonstrations.builtin.whole_body import joints_of, perform
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.scenes import platform

FPS = 30.0
_DEPTH, _WIDTH = 1.6, 1.6
_PAUSE = 0.6  # on top, s
_PACE = 1.15  # how much faster than planned


@lru_cache(maxsize=1)
def climb() -> Demonstration:
    """Makes the demonstration; the same on every call.

    A person of 1.72 m walks up to a platform of 1.20 m, lays the hands on it, steps against its
    wall, pushes up, kneels on it, stands up; then climbs down the same way, backwards and with the
    other leg first.
    """
    plan = plan_ascent()
    time = np.arange(0.0, plan.end, _PACE / FPS)
    up = joints_of(human.JOINTS, perform(plan, time))
    # The way down is the way up in a mirror, played backwards.
    mirror = [human.JOINTS.index(_other(name)) for name in human.JOINTS]
    down = up[::-1, mirror] * [1.0, -1.0, 1.0]
    rest = np.repeat(up[-1:], round(_PAUSE * FPS), axis=0)
    positions = np.concatenate([up, rest, down])
    positions.setflags(write=False)  # every caller gets the same array
    skeleton = human.SKELETON
    return Demonstration(
        name="climb",
        fps=FPS,
        joint_names=skeleton.joint_names,
        positions=positions,
        keypoint_joints=skeleton.keypoint_joints,
        height=human.HEIGHT,
        scene=platform(PLATFORM, _DEPTH, _WIDTH),
        contact_joints=skeleton.contact_joints,
        source="made by omni_envs",
        licence="Apache-2.0",
    )


def _other(name: str) -> str:
    sides = {"L_": "R_", "R_": "L_"}
    return sides.get(name[:2], name[:2]) + name[2:]
