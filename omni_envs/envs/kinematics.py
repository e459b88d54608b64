"""Where the bodies are: a second batch that computes kinematics only.

After ``Batch.step`` the bodies lag the state by a physics step. Computing that stage again in the
simulated model would repeat collision detection and the constraint rows, an eighth of a control
step; here the same robot without geoms, limits and actuators costs a third of that.
"""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch

from omni_envs.robots import Robot
from omni_envs.tracking.alignment import Bodies

_STAGE = int(mujoco.mjtStage.mjSTAGE_VEL)

_SENSORS = (
    (mujoco.mjtSensor.mjSENS_FRAMEPOS, 3),
    (mujoco.mjtSensor.mjSENS_FRAMEQUAT, 4),
    (mujoco.mjtSensor.mjSENS_FRAMELINVEL, 3),
    (mujoco.mjtSensor.mjSENS_FRAMEANGVEL, 3),
)


class BodyKinematics:
    """Poses and velocities of the tracked bodies of N simulations.

    Args:
        robot: The robot.
        num: N.
        threads: Threads; 0 takes every core.
    """

    def __init__(self, robot: Robot, num: int, threads: int) -> None:
        self._nq, self._nv, self._num = robot.nq, robot.nv, num
        self._batch = Batch(_bare_model(robot), num, threads)
        self._qpos, self._qvel = self._batch.bind("qpos"), self._batch.bind("qvel")
        data, bodies = self._batch.bind("sensordata"), len(robot.tracked_bodies)
        parts, start = [], 0
        for _, size in _SENSORS:
            columns = data[:, start : start + size * bodies]
            parts.append(columns.reshape(num, bodies, size))
            start += size * bodies
        self._bodies = Bodies(*parts)
        if not all(np.shares_memory(part, data) for part in parts):
            raise RuntimeError("Sensor data must be read without copies.")

    def update(self, qpos: np.ndarray, qvel: np.ndarray, ids: np.ndarray | None = None) -> None:
        """Computes the bodies at (N, nq) and (N, nv) states, of all simulations or of some."""
        if ids is None:
            np.copyto(self._qpos, qpos[:, : self._nq])
            np.copyto(self._qvel, qvel[:, : self._nv])
        else:
            self._qpos[ids], self._qvel[ids] = qpos[ids, : self._nq], qvel[ids, : self._nv]
        self._batch.forward(ids, stage=_STAGE)

    def bodies(self, ids: np.ndarray | None = None) -> Bodies:
        """Returns the bodies of the last update: live views of all, or copies of some."""
        return self._bodies if ids is None else Bodies(*(part[ids] for part in self._bodies))


def _bare_model(robot: Robot) -> mujoco.MjModel:
    spec = robot.spec()
    for element in (*spec.geoms, *spec.actuators):
        spec.delete(element)
    for kind, _ in _SENSORS:
        for body in robot.tracked_bodies:
            sensor = spec.add_sensor(name=f"{kind.name}_{body}", type=kind)
            sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_XBODY, body
    off = mujoco.mjtDisableBit
    for bit in (off.mjDSBL_CONSTRAINT, off.mjDSBL_GRAVITY, off.mjDSBL_ACTUATION):
        spec.option.disableflags |= int(bit)
    return spec.compile()
