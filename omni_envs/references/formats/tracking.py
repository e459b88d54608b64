"""Motions of the BeyondMimic family: hinges without root, poses of all bodies, often no names.

Without names the order of the hinges is a matter of the simulator that wrote the file: MuJoCo goes
through the robot depth first, Isaac breadth first. A file is read in the order whose forward
kinematics puts the bodies where the file says they are.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.references.formats.holosoma import joint_order
from omni_envs.references.formats.motion import (
    ForeignMotion,
    MotionFormat,
    checked_poses,
    read_floats,
    read_fps,
    whole_fps,
)
from omni_envs.references.kinematics import body_kinematics
from omni_envs.robots import Robot

if TYPE_CHECKING:
    from omni_envs.references.reference import Reference

# Bodies may stand this far (m) from where our model of the robot has them: models differ.
_SAME = 0.02
_SAMPLES = 20  # frames that are looked at to tell the order


class Mjlab(MotionFormat):
    """``joint_pos`` (T, n), ``joint_vel``, ``body_{pos,quat,lin_vel,ang_vel}_w``, depth first."""

    name = "mjlab"
    title = "mjlab motion (.npz), depth-first joints"
    breadth_first = False

    def recognises(self, arrays: Mapping[str, np.ndarray], robot: Robot) -> bool:  # noqa: D102
        if not {"joint_pos", "body_pos_w", "body_quat_w", "fps"} <= arrays.keys():
            return False
        return self.breadth_first == (_order_of(arrays, robot) == "breadth")

    def read(  # noqa: D102
        self, path: Path, arrays: Mapping[str, np.ndarray], robot: Robot, fps: float | None
    ) -> ForeignMotion:
        qpos = _unordered(path, arrays, robot)
        if "joint_names" in arrays:
            order = joint_order(path, arrays, robot)
        else:
            told = _order_of(arrays, robot)
            if told is None:
                raise FileFormatError(
                    path,
                    "joint_pos",
                    f"hinges of {robot.title} that put the bodies where body_pos_w has them, depth "
                    "first (mjlab) or breadth first (Isaac)",
                    "neither",
                )
            order = _stored_order(robot, told == "breadth")
        qpos[:, 7:] = qpos[:, [7 + i for i in order]]
        rate = self._rate(path, arrays, fps)
        return ForeignMotion(path, self.name, robot, rate, checked_poses(path, "body_quat_w", qpos))

    def _rate(self, path: Path, arrays: Mapping[str, np.ndarray], fps: float | None) -> float:
        return read_fps(path, arrays["fps"])

    def arrays(self, reference: Reference, robot: Robot) -> dict[str, np.ndarray]:  # noqa: D102
        joints, bodies = (
            joint_places(robot, self.breadth_first),
            body_places(robot, self.breadth_first),
        )
        return {
            "fps": whole_fps(reference, self.name),
            "joint_pos": reference.joint_positions[:, joints],
            "joint_vel": reference.joint_velocities[:, joints],
            "body_pos_w": reference.body_positions[:, bodies],
            "body_quat_w": reference.body_quaternions[:, bodies],
            "body_lin_vel_w": reference.body_linear_velocities[:, bodies],
            "body_ang_vel_w": reference.body_angular_velocities[:, bodies],
            # Superset: readers that go by position ignore the names.
            "joint_names": np.array([robot.joint_names[i] for i in joints]),
            "body_names": np.array([reference.body_names[i] for i in bodies]),
        }


class BeyondMimic(Mjlab):
    """The same, joints and bodies breadth first, as Isaac has them."""

    name = "beyondmimic"
    title = "BeyondMimic / Isaac Lab motion (.npz), breadth-first joints"
    breadth_first = True


class UnitreeDeploy(Mjlab):
    """What Unitree's deploy code reads: float32, no rate (50 Hz), no body velocities."""

    name = "unitree_deploy"
    title = "Unitree deploy motion (.npz, 50 Hz)"
    assumed_fps = 50.0

    def recognises(self, arrays: Mapping[str, np.ndarray], robot: Robot) -> bool:  # noqa: D102
        return {"joint_pos", "body_pos_w", "body_quat_w"} <= arrays.keys() and "fps" not in arrays

    def _rate(self, path: Path, arrays: Mapping[str, np.ndarray], fps: float | None) -> float:
        return fps or self.assumed_fps

    def arrays(self, reference: Reference, robot: Robot) -> dict[str, np.ndarray]:  # noqa: D102
        if reference.fps != self.assumed_fps:
            raise InvalidOptionError(
                f"format {self.name!r}: takes {self.assumed_fps:g} frames per second for granted; "
                f"the reference has {reference.fps:g}. Make it with fps=50."
            )
        arrays = super().arrays(reference, robot)
        kept = ("body_pos_w", "body_quat_w", "joint_pos", "joint_vel")
        return {name: arrays[name].astype(np.float32) for name in kept}


def joint_places(robot: Robot, breadth_first: bool) -> list[int]:
    """Returns the hinges, as places in model order, in the order of a file."""
    if not breadth_first:
        return list(range(len(robot.joint_names)))
    model = robot.model
    places = []
    for body in _breadth_first(robot):
        start, count = model.body_jntadr[body], model.body_jntnum[body]
        hinges = range(int(start), int(start + count)) if count else ()
        places += [j - 1 for j in hinges if j > 0]  # joint 0 is the free one
    return places


def body_places(robot: Robot, breadth_first: bool) -> list[int]:
    """Returns the bodies, as places in model order without the world, in the order of a file."""
    if not breadth_first:
        return list(range(len(robot.body_names)))
    return [body - 1 for body in _breadth_first(robot)]


def _breadth_first(robot: Robot) -> list[int]:
    parents = np.asarray(robot.model.body_parentid)
    order, queue = [], deque([1])
    while queue:
        body = queue.popleft()
        order.append(body)
        queue.extend(int(b) for b in np.flatnonzero(parents == body) if b != body)
    return order


def _stored_order(robot: Robot, breadth_first: bool) -> list[int]:
    """Where each hinge, in model order, stands in the file."""
    return np.argsort(joint_places(robot, breadth_first)).tolist()


def _unordered(path: Path, arrays: Mapping[str, np.ndarray], robot: Robot) -> np.ndarray:
    """(T, 7 + n) root of body 0 and hinges in the file's order."""
    joints = read_floats(path, "joint_pos", arrays["joint_pos"])
    hinges = len(robot.joint_names)
    if joints.shape[1] != hinges:
        raise FileFormatError(
            path, "joint_pos", f"(T, {hinges}) for {robot.title}", str(joints.shape)
        )
    root = []
    for name, width in (("body_pos_w", 3), ("body_quat_w", 4)):
        array = read_floats(path, name, arrays[name], dimensions=3)
        if array.shape[0] != len(joints) or not array.shape[1] or array.shape[2] != width:
            raise FileFormatError(path, name, f"({len(joints)}, bodies, {width})", str(array.shape))
        root.append(array[:, 0])
    return np.concatenate([*root, joints], axis=1)


def _order_of(arrays: Mapping[str, np.ndarray], robot: Robot) -> str | None:
    """``"depth"``, ``"breadth"`` or None for neither; by names where there are some."""
    hinges = len(robot.joint_names)
    if "joint_names" in arrays:
        names = [str(n) for n in arrays["joint_names"].reshape(-1)]
        breadth = [robot.joint_names[i] for i in joint_places(robot, True)]
        return "breadth" if names == breadth else "depth"
    joints, bodies, turns = (arrays[k] for k in ("joint_pos", "body_pos_w", "body_quat_w"))
    if joints.ndim != 2 or joints.shape[1] != hinges or bodies.ndim != 3 or turns.ndim != 3:
        return "depth"  # reading says what is wrong
    if len({len(joints), len(bodies), len(turns)}) > 1 or not len(joints) or not bodies.shape[1]:
        return "depth"
    frames = np.unique(np.linspace(0, len(joints) - 1, _SAMPLES).astype(int))
    root = np.concatenate([bodies[frames, 0], turns[frames, 0]], axis=1)
    errors = {}
    for kind in ("depth", "breadth"):
        order = _stored_order(robot, kind == "breadth")
        qpos = np.concatenate([root, joints[frames][:, order]], axis=1).astype(float)
        if not np.isfinite(qpos).all():
            return "depth"
        positions = body_kinematics(robot.model, qpos, np.zeros((len(qpos), robot.nq - 1)))[0]
        tracked = positions[:, [robot.body_names.index(b) for b in robot.tracked_bodies]]
        # Bodies of other models need not be ours: each of ours is near one of theirs.
        gaps = np.linalg.norm(tracked[:, :, None] - bodies[frames][:, None], axis=-1).min(axis=2)
        errors[kind] = gaps.max()
    kind = min(errors, key=lambda k: errors[k])
    return kind if errors[kind] <= _SAME else None
