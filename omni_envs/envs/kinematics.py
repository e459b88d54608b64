"""Where the tracked bodies are.

After ``Batch.step`` MuJoCo's bodies lag the state by a physics step. Computing that stage again in
the simulated model would repeat collision detection and the constraint rows, an eighth of a control
step; the compiled kinematics of the tracked bodies alone cost a hundredth.
"""

from __future__ import annotations

import mujoco
import numpy as np

from omni_envs.robots import Robot
from omni_envs.tracking import kernels
from omni_envs.tracking.alignment import Bodies


class BodyKinematics:
    """Poses and velocities of the tracked bodies of N simulations.

    Attributes:
        tree: The bodies that tracked bodies hang on.

    Args:
        robot: The robot.
        num: N.
    """

    def __init__(self, robot: Robot, num: int) -> None:
        self.tree, self._everyone = body_tree(robot), np.arange(num)
        count = len(robot.tracked_bodies)
        self._bodies = Bodies(*(np.zeros((num, count, size)) for size in (3, 4, 3, 3)))

    def update(self, qpos: np.ndarray, qvel: np.ndarray, ids: np.ndarray | None = None) -> None:
        """Computes the bodies at (N, nq) and (N, nv) states, of all simulations or of some."""
        ids = self._everyone if ids is None else ids
        kernels.place_bodies(self.tree, qpos, qvel, ids, self._bodies)

    def bodies(self, ids: np.ndarray | None = None) -> Bodies:
        """Returns the bodies of the last update: live views of all, or copies of some."""
        return self._bodies if ids is None else Bodies(*(part[ids] for part in self._bodies))


def body_tree(robot: Robot) -> kernels.Tree:
    """Returns the bodies that tracked bodies hang on, in the form that the kernels take."""
    model = robot.model
    needed = set()
    for name in robot.tracked_bodies:
        body = model.body(name).id
        while body:
            needed.add(body)
            body = int(model.body_parentid[body])
    bodies = sorted(needed)
    place = {body: k for k, body in enumerate(bodies)}
    slots = {model.body(name).id: k for k, name in enumerate(robot.tracked_bodies)}
    free = int(mujoco.mjtJoint.mjJNT_FREE)
    hinges: list[int] = []
    first = [0]
    for body in bodies:
        start = int(model.body_jntadr[body])
        joints = range(start, start + int(model.body_jntnum[body]))
        hinges += [j for j in joints if int(model.jnt_type[j]) != free]
        first.append(len(hinges))
    address = model.jnt_qposadr[hinges]
    return kernels.Tree(
        parent=np.array([place.get(int(model.body_parentid[b]), -1) for b in bodies]),
        slot=np.array([slots.get(b, -1) for b in bodies]),
        position=model.body_pos[bodies],
        quaternion=model.body_quat[bodies],
        first=np.array(first),
        axis=model.jnt_axis[hinges],
        anchor=model.jnt_pos[hinges],
        zero=model.qpos0[address],
        joint=np.asarray(address, int) - 7,
        turned=np.array(
            [not np.array_equal(model.body_quat[b], (1, 0, 0, 0)) for b in bodies], int
        ),
        aside=np.array(model.jnt_pos[hinges].any(axis=1), int),
    )
