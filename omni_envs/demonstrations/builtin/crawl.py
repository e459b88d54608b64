"""The built-in crawl: up a slope on hands and knees, onto a block, and up on both feet."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.crawl_plan import ANGLE, BLOCK, plan_crawl
from omni_envs.demonstrations.builtin.whole_body import joints_of, perform
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.scenes import slope_onto_block

FPS = 30.0
_DEPTH, _WIDTH = 1.6, 1.6


@lru_cache(maxsize=1)
def crawl() -> Demonstration:
    """Makes the demonstration; the same on every call.

    A person of 1.72 m kneels down before a slope of 13°, crawls up on hands and knees in diagonal
    pairs onto a block of 0.34 m, and stands up there.
    """
    plan = plan_crawl()
    time = np.arange(0.0, plan.end, 1.0 / FPS)
    positions = joints_of(human.JOINTS, perform(plan, time))
    positions.setflags(write=False)  # every caller gets the same array
    skeleton = human.SKELETON
    return Demonstration(
        name="crawl",
        fps=FPS,
        joint_names=skeleton.joint_names,
        positions=positions,
        keypoint_joints=skeleton.keypoint_joints,
        height=human.HEIGHT,
        scene=slope_onto_block(ANGLE, BLOCK, _DEPTH, _WIDTH),
        contact_joints=skeleton.contact_joints,
        source="made by omni_envs",
        licence="Apache-2.0",
    )
