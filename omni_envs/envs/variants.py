"""Randomized models: drawn and completed once, handed to episodes when they start."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import mujoco
import numpy as np
from mujoco import batch

from omni_envs.envs.model import EnvModel
from omni_envs.errors import InvalidDataError, InvalidOptionError
from omni_envs.robots import Robot
from omni_envs.scenes import OBJECT, Box, SceneObject
from omni_envs.tracking import kernels
from omni_envs.tracking.config import ObjectRandomization, RandomizationConfig
from omni_envs.tracking.randomization import scaled_inertia, symmetric

_SEED = 20260101
"""Added to the seed of the option: variants do not depend on the environment's own seed."""


class ModelVariants:
    """A pool of randomized models of one layout, ``count`` for every scene.

    Completing a randomized model (``mj_setConst``) costs as much as several control steps, so a
    pool of them is made once. An episode that starts gets a variant: the fields in which variants
    differ are copied into its simulation, or, where scenes or meshes differ, it runs on the
    variant's model.

    Attributes:
        count: Number of variants of a scene.
        fields: Model field to (count, …) values, for the fields in which the variants differ.
        models: The variants themselves where scenes or meshes differ, scene by scene, else empty.

    Args:
        env_models: The models without randomization, one per scene.
        robot: The robot in them.
        objects: The objects in them.
        config: What to randomize.

    Raises:
        InvalidOptionError: There would be no variant.
    """

    def __init__(
        self,
        env_models: Sequence[EnvModel],
        robot: Robot,
        objects: Sequence[SceneObject | None],
        config: RandomizationConfig,
    ) -> None:
        if config.variants < 1:
            raise InvalidOptionError("randomization.variants must be at least 1.")
        pools = [_draw(m, robot, o, config) for m, o in zip(env_models, objects, strict=True)]
        self.count = len(pools[0])
        self.fields: dict[str, np.ndarray] = {}
        self.models: tuple[mujoco.MjModel, ...] = ()
        shaped = config.object is not None and config.object.shape > 0
        if len(pools) > 1 or (shaped and _has_meshes(objects[0])):
            self.models = tuple(model for pool in pools for model in pool)
        else:
            self.fields = _differing_fields(env_models[0].model, pools[0])

    def choose(self, scenes: np.ndarray, motions: np.ndarray, draws: np.ndarray) -> np.ndarray:
        """Draws variants for episodes.

        Args:
            scenes: (M,) scenes of all motions.
            motions: (K,) motions of the episodes.
            draws: (K,) uniform in [0, 1).

        Returns:
            (K,) indices of variants.
        """
        chosen = np.empty(len(motions), int)
        kernels.choose_models(scenes, motions, self.count, draws, chosen)
        return chosen

    def attach(self, simulations: batch.Batch) -> dict[str, np.ndarray]:
        """Gives every differing field one value per simulation; returns the live arrays.

        Raises:
            InvalidDataError: The scenes have models of different layout.
        """
        try:
            if self.models:
                for start in range(0, len(self.models), self.count):
                    simulations.set_models(self.models[start])
        except mujoco.FatalError as error:
            expected = "references whose scenes have the same kinds and numbers of shapes"
            raise InvalidDataError("Environment", "reference", expected, str(error)) from error
        live = {name: simulations.expand(name) for name in self.fields}
        # Of the bounding volumes only those of bodies can differ, not those inside meshes.
        self.fields = {name: v[:, : live[name].shape[1]] for name, v in self.fields.items()}
        return live


def _draw(
    env_model: EnvModel, robot: Robot, scene_object: SceneObject | None, config: RandomizationConfig
) -> list[mujoco.MjModel]:
    """Returns the variants of one scene; the model itself where nothing is randomized."""
    model = env_model.model
    objects = config.object if scene_object is not None else None
    if not (config.torso_centre_of_mass or config.friction or objects):
        return [model]
    rng, data = np.random.default_rng(_SEED + config.seed), mujoco.MjData(model)
    meshes = _has_meshes(scene_object)
    variants = []
    for _ in range(config.variants):
        if objects is not None and objects.shape and meshes and scene_object is not None:
            factor = 1.0 + objects.shape * (2.0 * rng.random() - 1.0)
            variant = _compile_scaled(env_model.spec, scene_object, factor)
        else:
            variant = copy.copy(model)
        if config.torso_centre_of_mass is not None:
            torso = variant.body(robot.torso_body).id
            variant.body_ipos[torso] += symmetric(rng, 1, config.torso_centre_of_mass)[0]
        if config.friction is not None:
            geoms = [g for g in range(model.ngeom) if _body(model, g) in robot.body_names]
            variant.geom_friction[geoms, 0] = rng.uniform(*config.friction)
        if objects is not None and scene_object is not None:
            share = 0.0 if meshes else objects.shape
            scale = _scale_boxes(variant, scene_object, share, rng)
            _randomize_mass(variant, scale, objects, rng)
        mujoco.mj_setConst(variant, data)
        variants.append(variant)
    return variants


def _has_meshes(scene_object: SceneObject | None) -> bool:
    return scene_object is not None and not all(
        isinstance(p.shape, Box) for p in scene_object.parts
    )


def _compile_scaled(
    spec: mujoco.MjSpec, scene_object: SceneObject, factor: float
) -> mujoco.MjModel:
    """Compiles the model with the object scaled as a whole, its mass unchanged."""
    for i, part in enumerate(scene_object.parts):
        geom = spec.geom(f"{OBJECT}_{i}")
        geom.pos = factor * np.asarray(part.position)
        if isinstance(part.shape, Box):
            geom.size = factor * np.asarray(part.shape.half_extents)
        else:
            spec.mesh(geom.meshname).scale = np.full(3, factor)
    return spec.compile()


def _scale_boxes(
    model: mujoco.MjModel, scene_object: SceneObject, share: float, rng: np.random.Generator
) -> np.ndarray:
    """Scales the object's boxes by 1 ± share; returns the (3,) factors in the object's axes."""
    if not share:
        return np.ones(3)
    # Turned boxes would shear under a factor per axis.
    upright = all(np.allclose(p.quaternion, (1, 0, 0, 0)) for p in scene_object.parts)
    draws = 1.0 + share * (2.0 * rng.random(3) - 1.0)
    scale = draws if upright else np.full(3, draws[0])
    for i in range(len(scene_object.parts)):
        geom = model.geom(f"{OBJECT}_{i}").id
        model.geom_size[geom] *= scale
        model.geom_pos[geom] *= scale
        # What the compiler derives from a box's size, and mj_setConst leaves alone.
        model.geom_rbound[geom] = np.linalg.norm(model.geom_size[geom])
        model.geom_aabb[geom, 3:] = model.geom_size[geom]
    return scale


def _randomize_mass(
    model: mujoco.MjModel,
    scale: np.ndarray,
    config: ObjectRandomization,
    rng: np.random.Generator,
) -> None:
    """Sets mass, inertia and centre of mass of an object stretched by ``scale`` (3,)."""
    body = model.body(OBJECT).id
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body_iquat[body])
    principal: np.ndarray = rotation.reshape(3, 3)
    inertia = scaled_inertia(principal @ np.diag(model.body_inertia[body]) @ principal.T, scale)
    model.body_ipos[body] *= scale
    if config.mass is not None:
        mass = rng.uniform(*config.mass)
        inertia *= mass / model.body_mass[body]
        model.body_mass[body] = mass
    if config.inertia is not None:
        inertia *= rng.uniform(*config.inertia)
    model.body_inertia[body], axes = np.linalg.eigh(inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    mujoco.mju_mat2Quat(model.body_iquat[body], axes.ravel())
    if config.centre_of_mass:
        model.body_ipos[body] += symmetric(rng, 1, [config.centre_of_mass] * 3)[0]


def _body(model: mujoco.MjModel, geom: int) -> str:
    return model.body(int(model.geom_bodyid[geom])).name


def _differing_fields(
    model: mujoco.MjModel, variants: list[mujoco.MjModel]
) -> dict[str, np.ndarray]:
    fields = {}
    for name in sorted(f for f in batch.MODEL_FIELDS if not f.startswith("opt.")):
        base = getattr(model, name)
        if not isinstance(base, np.ndarray) or not base.size:
            continue
        values = np.stack([getattr(v, name) for v in variants])
        if (values != base).any():
            fields[name] = values
    return fields
