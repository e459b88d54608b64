"""The built-in box carry: walk up, squat, lift, carry round a slight turn, put down, step back."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.carry_body import perform
from omni_envs.demonstrations.builtin.carry_plan import BOX_MASS, BOX_SIZE, plan_box_carry
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.rotations import exp
from omni_envs.scenes import Box, Part, Scene, SceneObject

FPS = 30.0
_RATE = 4  # planned at 120 Hz, every 4th frame kept


@lru_cache(maxsize=1)
def box_carry() -> Demonstration:
    """Makes the demonstration; the same on every call.

    A person of 1.72 m walks up to a box of 0.26 × 0.36 × 0.32 m and 1.5 kg, lifts it with both
    palms on its sides, carries it four steps through a turn of 25°, puts it down and steps back.
    """
    plan = plan_box_carry()
    time = np.arange(0.0, plan.end, 1.0 / (FPS * _RATE))
    joints, box_positions, box_yaw = perform(plan, time)
    yaw = np.zeros((len(time), 3))
    yaw[:, 2] = box_yaw
    box_poses = np.concatenate([box_positions, exp(yaw)], axis=1)[::_RATE]
    held = ((time >= plan.grasp) & (time <= plan.release))[::_RATE]
    positions = np.stack([joints[name] for name in human.JOINTS], axis=1)[::_RATE]
    for shared in (positions, box_poses, held):
        shared.setflags(write=False)  # every caller gets the same arrays
    skeleton = human.SKELETON
    half = (0.5 * BOX_SIZE[0], 0.5 * BOX_SIZE[1], 0.5 * BOX_SIZE[2])
    return Demonstration(
        name="box_carry",
        fps=FPS,
        joint_names=skeleton.joint_names,
        positions=positions,
        keypoint_joints=skeleton.keypoint_joints,
        height=human.HEIGHT,
        scene=Scene(object=SceneObject("box", (Part(Box(half)),), mass=BOX_MASS)),
        object_poses=box_poses,
        contacts={"left_hand": held, "right_hand": held},
        contact_joints=skeleton.contact_joints,
        source="made by omni_envs",
        licence="Apache-2.0",
    )
