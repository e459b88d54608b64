"""The simulated model: robot, scene and the contact sensors that the reward reads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from omni_envs.errors import UnknownNameError
from omni_envs.robots import Robot
from omni_envs.scenes import OBJECT, Scene, build_spec
from omni_envs.tracking.config import TrackingConfig

# Last argument of a contact sensor: what it returns of several contacts.
_STRONGEST, _SUM = 2, 3

WBT_HISTORY = 3
"""Physics steps over which the contact rule ``"any"`` looks back."""


@dataclass(frozen=True)
class EnvModel:
    """A compiled model and where to read its contact sensors.

    Attributes:
        spec: The specification.
        model: The compiled model.
        contact_bodies: Names of the bodies that a contact sensor watches; empty where one sensor
            watches the whole robot.
        samples: Physics steps that the sensors remember.
    """

    spec: mujoco.MjSpec
    model: mujoco.MjModel
    contact_bodies: tuple[str, ...]
    samples: int

    def contact_forces(self, history: np.ndarray) -> np.ndarray:
        """Returns the (N, sensors, samples, 3) forces in the (N, nhistory) sensor history, N.

        A sensor's row is: user value, cursor, the samples' times, the samples. They are gathered
        component by component, which the reward reads fastest.
        """
        forces = np.take(history, self._columns, axis=1)
        shape = (len(history), 3, self._sensors, self.samples)
        return np.moveaxis(forces.reshape(shape), 1, 3)

    @cached_property
    def _columns(self) -> np.ndarray:
        sensor = np.arange(self._sensors) * (2 + 4 * self.samples)
        first = sensor[:, None] + 2 + self.samples + 3 * np.arange(self.samples)
        return (first[None] + np.arange(3)[:, None, None]).ravel()

    @property
    def _sensors(self) -> int:
        return self.model.nsensor


def build_model(robot: Robot, scene: Scene, config: TrackingConfig) -> EnvModel:
    """Compiles the model of one simulation: primitives only, object last, contact sensors.

    Args:
        robot: The robot.
        scene: Its scene.
        config: The task; contact rule, friction and physics shape the model.
    """
    spec = build_spec(robot, scene, config.physics.options, looks=False)
    colliding = [b.name for b in spec.bodies if b.name in robot.body_names and _collides(b)]
    rule = config.reward.contact_rule
    samples = config.physics.substeps
    root = (mujoco.mjtObj.mjOBJ_XBODY, robot.root_body)
    if rule == "substeps":
        watched: tuple[str, ...] = ()
        _add_contact_sensor(spec, "contact", root, root, _STRONGEST, samples)
    else:
        if rule == "any":
            links = robot.contact_links
            for link in config.reward.may_touch:
                if link not in links:
                    raise UnknownNameError("reward.may_touch link", link, links)
            free = {b for link in config.reward.may_touch for b in links[link]}
            watched = tuple(b for b in colliding if b not in free)
            samples = min(WBT_HISTORY, samples)
        else:
            watched = tuple(colliding)
        for body in watched:
            this = (mujoco.mjtObj.mjOBJ_BODY, body)
            if rule == "any":
                _add_contact_sensor(spec, f"contact_{body}", this, None, _SUM, samples)
            else:
                _add_contact_sensor(spec, f"contact_{body}", this, root, _STRONGEST, samples)
    if config.randomization.friction is not None:
        # The robot's own friction decides in its contacts, so that a low draw is felt on rough
        # ground.
        for geom in spec.geoms:
            if geom.parent.name in robot.body_names:
                geom.priority = 1
    if scene.object is not None:
        # Its centre of mass may be moved after compilation: no shortcut for a centred body.
        spec.body(OBJECT).simple = False
    return EnvModel(spec, spec.compile(), watched, samples)


def _collides(body: mujoco.MjsBody) -> bool:
    return any(geom.contype or geom.conaffinity for geom in body.geoms)


def _add_contact_sensor(
    spec: mujoco.MjSpec,
    name: str,
    first: tuple[mujoco.mjtObj, str],
    second: tuple[mujoco.mjtObj, str] | None,
    reduce: int,
    samples: int,
) -> None:
    sensor = spec.add_sensor(name=name, type=mujoco.mjtSensor.mjSENS_CONTACT)
    sensor.objtype, sensor.objname = first
    if second is not None:
        sensor.reftype, sensor.refname = second
    sensor.intprm[:3] = [1 << int(mujoco.mjtConDataField.mjCONDATA_FORCE), reduce, 1]
    # The last physics steps' values are kept, so that one call for all of them misses no contact.
    sensor.nsample = samples
