"""The method of GMR (github.com/YanjieZe/GMR, version 0.1) in our words, to compare with.

Damped least squares on the poses of 14 bodies by mink, twice per frame: first root, feet and all
orientations, then all bodies. Joint limits are the only constraint: no surroundings, no contact, no
smoothness beyond the warm start.

The result is that of the original; it takes about half the time, since targets are prepared for all
frames at once, and the first frame is solved until it has arrived.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import Literal

import mink
import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations import Demonstration, scale_demonstration
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.progress import ProgressCallback
from omni_envs.retargeting.human_frames import HUMAN_BODIES, human_frames
from omni_envs.robots import Robot

Scale = Literal["ratio", "table"]

_DAMPING = 0.5
_LM_DAMPING = 1.0
_MORE_STEPS = 10
_PROGRESS = 1e-3  # a stage goes on while the norm of its unweighted errors falls by more
_FIRST_SOLVES = 10  # frame 0 starts far away; without these the motion starts with a jump
_TABLE_HEIGHT = 1.8  # height of the human that a scale table is made for, m


@dataclass(frozen=True)
class GmrMatch:
    """What a robot frame follows.

    Attributes:
        body: Robot body.
        rotation: Quaternion wxyz, robot frame = human frame ⊗ rotation.
        first: Position and orientation weight in the first stage.
        second: The same in the second stage.
        scale: Scale of the human body in mode ``"table"``.
        point: Point of the robot body that is matched, body frame, m.
        offset: Shift of the target in the robot frame, m.
    """

    body: str
    rotation: tuple[float, float, float, float]
    first: tuple[float, float]
    second: tuple[float, float]
    scale: float
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class GmrMotion:
    """A robot motion made by ``gmr_retarget``.

    Attributes:
        robot: Name of the robot.
        fps: Frames per second.
        qpos: (T, 7 + n) robot configurations.
        object_poses: (T, 7) object poses in the target scene, or None. The method ignores them.
        iterations: (T,) quadratic programs solved.
        seconds: (T,) solve time.
    """

    robot: str
    fps: float
    qpos: np.ndarray
    object_poses: np.ndarray | None
    iterations: np.ndarray
    seconds: np.ndarray

    @property
    def num_frames(self) -> int:
        """T."""
        return len(self.qpos)


def _g1_matches() -> dict[str, GmrMatch]:
    upright = (0.5, -0.5, -0.5, -0.5)
    matches = {
        "pelvis": GmrMatch("pelvis", upright, (100, 10), (100, 5), 0.9),
        "torso": GmrMatch("torso_link", upright, (0, 10), (0, 10), 0.9),
    }
    thigh = (0.4267755048530407, -0.5637931078484661, -0.5637931078484661, -0.4267755048530407)
    half = float(np.sqrt(0.5))
    for side, sign, shoulder, arm in (
        ("left", 1.0, (half, 0.0, -half, 0.0), (1.0, 0.0, 0.0, 0.0)),
        ("right", -1.0, (0.0, half, 0.0, half), (0.0, 0.0, 0.0, -1.0)),
    ):
        foot = f"{side}_ankle_roll_link"
        toe, outwards = (0.1, 0.0, -0.02), (0.0, 0.02 * sign, 0.0)
        for body, match in {
            "hip": GmrMatch(f"{side}_hip_roll_link", thigh, (0, 10), (10, 5), 0.9),
            "knee": GmrMatch(f"{side}_knee_link", upright, (0, 10), (10, 5), 0.9),
            "foot": GmrMatch(foot, upright, (100, 10), (100, 50), 0.9, toe, outwards),
            "shoulder": GmrMatch(f"{side}_shoulder_yaw_link", shoulder, (0, 10), (10, 5), 0.8),
            "elbow": GmrMatch(f"{side}_elbow_link", arm, (0, 10), (10, 5), 0.8),
            "wrist": GmrMatch(f"{side}_wrist_yaw_link", arm, (0, 10), (10, 5), 0.8),
        }.items():
            matches[f"{side}_{body}"] = match
    return matches


GMR_MATCHES = {"g1": _g1_matches()}
"""Robot to human body to what follows it: GMR's table for SMPL-X motion."""


def gmr_retarget(
    demonstration: Demonstration,
    robot: Robot,
    *,
    scale: Scale = "ratio",
    progress: ProgressCallback | None = None,
) -> GmrMotion:
    """Retargets by matching body poses, as GMR does.

    Every QP minimises ‖W(J dq - e)‖² + (0.5 + μ)‖dq‖², μ = Σ weighted error², subject to the joint
    limits; a stage solves QPs while they help, at most 11.

    Args:
        demonstration: The human motion. Its orientations are used where their convention is known,
            and estimated from positions otherwise (``human_frames``).
        robot: The robot.
        scale: ``"ratio"`` shrinks the human about the world's origin by the ratio of heights, as
            OmniRetarget's comparison does; ``"table"`` scales every body about the root by GMR's
            own table, and the paths of root and object by the root's scale.
        progress: Called with (frames done, frames in all).

    Returns:
        The robot motion at the demonstration's fps.

    Raises:
        UnknownNameError: No table for this robot.
        InvalidOptionError: No such scale.
    """
    if robot.name not in GMR_MATCHES:
        raise UnknownNameError("robot of the GMR comparator", robot.name, GMR_MATCHES)
    if scale not in ("ratio", "table"):
        raise InvalidOptionError(f"gmr_retarget: scale must be ratio or table; got {scale!r}.")
    matches = GMR_MATCHES[robot.name]
    source = scale_demonstration(demonstration, robot.height)
    scales = _scales(demonstration, source.scale, matches, scale)
    poses = _targets(demonstration, source, matches, scales)
    ik = _TwoStageIk(robot, matches)
    for _ in range(_FIRST_SOLVES):
        ik.solve(poses[0])
    frames = len(poses)
    qpos = np.empty((frames, robot.nq))
    iterations, seconds = np.empty(frames, int), np.empty(frames)
    for t in range(frames):
        start = perf_counter()
        qpos[t], iterations[t] = ik.solve(poses[t])
        seconds[t] = perf_counter() - start
        if progress is not None:
            progress(t + 1, frames)
    object_poses = source.object_poses
    if demonstration.object_poses is not None and scale == "table":
        # The robot walks as far as the scale of the root says, and the object with it.
        rest = demonstration.object_poses[0, :3] * (0.0, 0.0, 1.0)
        object_poses = demonstration.object_poses.copy()
        object_poses[:, :3] = scales[0] * (object_poses[:, :3] - rest) + rest
    return GmrMotion(robot.name, demonstration.fps, qpos, object_poses, iterations, seconds)


def _scales(
    demonstration: Demonstration, ratio: float, matches: Mapping[str, GmrMatch], scale: Scale
) -> np.ndarray:
    """(14,) scale of every human body, the root's first."""
    if scale == "ratio":
        return np.full(len(HUMAN_BODIES), ratio)
    taller = demonstration.height / _TABLE_HEIGHT
    return np.array([matches[body].scale * taller for body in HUMAN_BODIES])


def _targets(
    demonstration: Demonstration,
    source: SourceMotion,
    matches: Mapping[str, GmrMatch],
    scales: np.ndarray,
) -> np.ndarray:
    """(T, 14, 7) target poses of the matched robot frames, quaternion wxyz first."""
    positions, quaternions = human_frames(demonstration)
    # The ground that scaling the demonstration found: a shift of all frames.
    positions = positions + (source.keypoints / source.scale - demonstration.keypoints)[:1, :1]
    root = positions[:, :1]
    scaled = scales[0] * root + scales[:, None] * (positions - root)
    rules = [matches[body] for body in HUMAN_BODIES]
    turned = rotations.multiply(quaternions, np.array([rule.rotation for rule in rules]))
    offsets = np.array([rule.offset for rule in rules])
    scaled = scaled + rotations.rotate(turned, np.broadcast_to(offsets, scaled.shape))
    return np.concatenate([turned, scaled], axis=-1)


class _TwoStageIk:
    """The tasks of both stages, warm-started from frame to frame."""

    def __init__(self, robot: Robot, matches: Mapping[str, GmrMatch]) -> None:
        rules = [matches[body] for body in HUMAN_BODIES]
        spec = robot.spec()
        for name, rule in zip(HUMAN_BODIES, rules, strict=True):
            spec.body(rule.body).add_site(name=_site(name), pos=rule.point)
        model = spec.compile()
        self._configuration = mink.Configuration(model)
        self._limits = [mink.ConfigurationLimit(model)]
        self._stages = [
            [
                mink.FrameTask(_site(name), "site", *weights, lm_damping=_LM_DAMPING)
                for name, weights in zip(HUMAN_BODIES, stage, strict=True)
            ]
            for stage in ([r.first for r in rules], [r.second for r in rules])
        ]

    def solve(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """Solves a frame.

        Args:
            poses: (14, 7) targets, quaternion wxyz first.

        Returns:
            (nq,) configuration and the number of QPs solved.
        """
        targets = [mink.SE3(pose) for pose in poses]
        count = 0
        for tasks in self._stages:
            for task, target in zip(tasks, targets, strict=True):
                task.set_target(target)
            error, last = self._error(tasks), np.inf
            for _ in range(1 + _MORE_STEPS):
                if last - error <= _PROGRESS:
                    break
                self._step(tasks)
                count += 1
                last, error = error, self._error(tasks)
        return self._configuration.q.copy(), count

    def _error(self, tasks: list[mink.FrameTask]) -> float:
        errors = [task.compute_error(self._configuration) for task in tasks]
        return float(np.linalg.norm(errors))

    def _step(self, tasks: list[mink.FrameTask]) -> None:
        # The time step only scales the velocity: any other gives the same configuration.
        velocity = mink.solve_ik(
            self._configuration, tasks, 1.0, "daqp", damping=_DAMPING, limits=self._limits
        )
        self._configuration.integrate_inplace(velocity, 1.0)


def _site(name: str) -> str:
    return f"gmr_{name}"
