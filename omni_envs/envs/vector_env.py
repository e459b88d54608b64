"""The vector environment: N humanoids that track references, on MuJoCo's threaded batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from omni_envs.envs.batches import (
    Infos,
    Observation,
    add_finals,
    copied,
    empty_observations,
    observation_space,
    real_array,
)
from omni_envs.envs.compiled import CompiledTask, Judged
from omni_envs.envs.divergence import Divergence, DivergenceLog
from omni_envs.envs.episodes import Episodes, NoiseLevel, ObjectGate
from omni_envs.envs.learning_state import learning_state, restore_learning_state
from omni_envs.envs.model import build_model
from omni_envs.envs.options import (
    autoreset_mode_of,
    check_whole,
    merged_seed,
    refuse_unknown,
)
from omni_envs.envs.pictures import Pictures
from omni_envs.envs.references import ReferenceLike, distinct_scenes, resolve_references
from omni_envs.envs.simulation import Simulation
from omni_envs.envs.spec import PlainSpec
from omni_envs.envs.task import TrackingTask
from omni_envs.envs.tasks import get_task
from omni_envs.envs.variants import ModelVariants
from omni_envs.errors import InvalidDataError, InvalidOptionError, UnknownNameError
from omni_envs.robots import Robot, get_robot
from omni_envs.tracking import kernels
from omni_envs.tracking.config import (
    ActionConfig,
    ObservationConfig,
    PhysicsConfig,
    RandomizationConfig,
    ResetConfig,
    RewardConfig,
    TerminationConfig,
    make_config,
)
from omni_envs.tracking.feedforward import action_targets
from omni_envs.tracking.motion import MotionLibrary
from omni_envs.tracking.motion_sampling import MotionSampler
from omni_envs.tracking.randomization import push

RESET_OPTIONS = ("reset_mask", "motion", "frame")
"""Options of ``reset``."""

Options = Mapping[str, Any]

PLACE = ("motion", "frame")
"""Infos that a start has, too."""

RENDER_MODES = ("rgb_array",)
"""Values of ``render_mode`` beside None."""


class OmniVectorEnv(PlainSpec, VectorEnv[Observation, np.ndarray, np.ndarray]):
    """N simulations of a robot that tracks a reference; see ``OmniEnv`` for spaces and rewards.

    A control step: the action is held over the physics substeps; terminations and rewards compare
    the new state with the reference frame that the policy saw; finished simulations restart
    (SAME_STEP); the reference moves on by a frame; pushes; observations.

    The end of a motion and the time-out are truncations. The same seed and actions give
    bit-identical results at any number of threads.

    Attributes:
        robot: The robot.
        config: Every number of the task.
        references: What is tracked.
        scenes: The different scenes of the references.
        policy_layout: Names and slices of the policy's observation.
        critic_layout: Names and slices of the privileged observation.
        simulation: The physics.
        sampler: Where episodes start.
        action_targets: (T, n) per reference, the joint positions (rad) that actions count from, or
            None where that is the default pose.
        divergences: The latest diverged simulations, for replay.
        observations: Those of all simulations, overwritten in every step.

    Args:
        num_envs: N.
        robot: Name of the robot, or the robot.
        task: ``"box_carry"``, ``"climb"``, ``"crawl"`` or ``"track"``; all but the last have a
            built-in demonstration as the default reference.
        reference: A reference file, a ``Reference``, a ``Demonstration``, or a list of these.
        preset: ``"paper"`` or ``"beyondmimic"``.
        anchor: See ``TrackingConfig``; as all options down to ``physics``, where None keeps the
            preset's.
        reward: Dataclass or mapping.
        termination: Dataclass or mapping.
        observation: Dataclass or mapping.
        randomization: Dataclass or mapping.
        reset: Dataclass or mapping.
        action: Dataclass or mapping.
        physics: Dataclass, mapping, ``"default"`` or ``"fast"``.
        num_threads: Physics threads; 0 takes every core.
        autoreset_mode: SAME_STEP (``final_obs`` and ``final_info`` in the infos) or DISABLED
            (finished simulations wait for ``reset(options={"reset_mask": mask})``).
        max_episode_steps: Time-out in control steps, in place of ``termination.max_seconds``.
        render_mode: ``"rgb_array"`` or None.
        width: Pixels of a picture.
        height: Pixels of a picture.

    Raises:
        OmniEnvsError: An option or reference is not valid; the message names it.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        robot: str | Robot = "g1",
        task: str = "box_carry",
        reference: ReferenceLike | Sequence[ReferenceLike] | None = None,
        preset: str = "paper",
        anchor: str | None = None,
        reward: RewardConfig | Options | None = None,
        termination: TerminationConfig | Options | None = None,
        observation: ObservationConfig | Options | None = None,
        randomization: RandomizationConfig | Options | None = None,
        reset: ResetConfig | Options | None = None,
        action: ActionConfig | Options | None = None,
        physics: PhysicsConfig | Options | str | None = None,
        num_threads: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        **unknown: Any,
    ) -> None:
        refuse_unknown(type(self), unknown)
        for name, value, least in (
            ("num_envs", num_envs, 1),
            ("num_threads", num_threads, 0),
            ("max_episode_steps", 1 if max_episode_steps is None else max_episode_steps, 1),
            ("width", width, 1),
            ("height", height, 1),
        ):
            check_whole(name, value, least)
        self.autoreset_mode = autoreset_mode_of(autoreset_mode)
        chosen = get_task(task)
        self.config = config = make_config(
            preset,
            chosen.changes,
            anchor=anchor,
            reward=reward,
            termination=termination,
            observation=observation,
            randomization=randomization,
            reset=reset,
            action=action,
            physics=physics,
        )
        self.num_envs, self.robot = num_envs, get_robot(robot)
        dt = config.physics.control_step
        self.metadata = {
            "render_modes": list(RENDER_MODES),
            "render_fps": round(1 / dt),
            "autoreset_mode": self.autoreset_mode,
        }
        if render_mode not in (None, *RENDER_MODES):
            raise InvalidOptionError(
                f"render_mode must be None or 'rgb_array'; got {render_mode!r}."
            )
        self.render_mode = render_mode
        self.references = resolve_references(reference, self.robot, chosen)
        mode = config.action.mode
        self.action_targets = (
            None if mode == "default" else action_targets(self.robot, self.references, mode)
        )
        self._library = MotionLibrary(self.robot, self.references, 1 / dt, self.action_targets)
        self.scenes, self._scene_of = distinct_scenes(self.references)
        self._pictures = Pictures(self.robot, self.scenes, width, height)
        plain = TrackingTask(self.robot, config, self._library.has_object)
        models = [build_model(self.robot, scene, config) for scene in self.scenes]
        objects = [scene.object for scene in self.scenes]
        self._variants = ModelVariants(models, self.robot, objects, config.randomization)
        self.simulation = Simulation(
            models[0], self.robot, self._variants, num_envs, config.physics.substeps, num_threads
        )
        self._task = CompiledTask(
            plain, self._library, num_envs, models[0].samples, self.simulation.batch.nthread
        )
        if max_episode_steps is None and config.termination.max_seconds is not None:
            max_episode_steps = max(round(config.termination.max_seconds / dt), 1)
        default = self.robot.default_joint_array
        self._episodes = Episodes(self._library, default, num_envs, config, max_episode_steps)
        self._gate = ObjectGate(config.termination.object_after)
        self._noise = NoiseLevel(config.reset.growth)
        self._task.noise_share = self._noise.observed
        self.sampler = MotionSampler(self._library, config.reset)
        self.divergences = DivergenceLog()
        self._scale, self._limit = (
            self.robot.action_scale * config.action.scale,
            config.action.limit,
        )
        # What residual actions count from, as actions.
        targets = self._library.targets
        self._lead = np.empty((0, self.robot.num_joints))
        if targets is not None:
            self._lead = (targets - self.robot.default_joint_array) / self._scale
        self._started, self._over = False, np.zeros(num_envs, bool)
        names = (*self._task.figures, *self._task.flags, *PLACE)
        self._infos, self._start_infos = Infos(names, num_envs), Infos(PLACE, num_envs)
        self.policy_layout, self.critic_layout = plain.policy_layout, plain.critic_layout
        critic = self.critic_layout.size if config.observation.privileged else None
        self.single_observation_space = observation_space(self.policy_layout.size, critic)
        self.observations = empty_observations(num_envs, self.policy_layout.size, critic)
        limit, joints = config.action.limit, self.robot.num_joints
        self.single_action_space = spaces.Box(-limit, limit, (joints,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    @property
    def control_step(self) -> float:
        """Time between two actions, s."""
        return self.config.physics.control_step

    @property
    def object_test_active(self) -> bool:
        """Whether losing the object ends an episode yet; see ``ObjectGate``."""
        return self._gate.open

    @property
    def noise_level(self) -> float:
        """Share of the start noise that episodes get; see ``NoiseGrowth``."""
        return self._noise.level

    def learning_state(self) -> dict[str, Any]:
        """Returns what episodes have taught the environment, as JSON-compatible data.

        Failures of adaptive sampling, object gate and growth of the start noise: with them a
        training goes on where it was. See ``omni_envs.envs.learning_state``.
        """
        return learning_state(self.sampler, self._gate, self._noise)

    def restore_learning_state(self, state: Options) -> None:
        """Takes over what ``learning_state`` returned; a ``reset`` with a seed forgets it again.

        Raises:
            InvalidDataError: It is of an environment with other references or options.
        """
        restore_learning_state(state, self.sampler, self._gate, self._noise)
        self._task.noise_share = self._noise.observed

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: Options | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts all simulations anew, or those of a mask.

        Args:
            seed: Makes everything that follows reproducible; what adaptive sampling, the object
                gate and growing start noise have learnt is forgotten.
            options: ``reset_mask``: (N,) bool, the simulations to start; ``motion`` and ``frame``:
                where to start, integers or one per started simulation, instead of a draw.

        Returns:
            Observations of all simulations, and infos.
        """
        self.restart(seed, options)
        return copied(self.observations), self._start_infos.of(self._place())

    def restart(
        self, seed: int | list[int | None] | None = None, options: Options | None = None
    ) -> None:
        """Does what ``reset`` does; what comes next is in ``observations``."""
        value = None if seed is None else merged_seed(seed, self.num_envs)
        if value is not None:
            self._np_random, self._np_random_seed = seeding.np_random(value)
            self.sampler.reset()
            self._gate.reset()
            self._noise.reset()
            self._task.noise_share = self._noise.observed
        if not isinstance(options, Mapping | None):
            raise InvalidOptionError(f"reset: options must be a mapping or None; got {options!r}.")
        options = dict(options or {})
        for name in options:
            if name not in RESET_OPTIONS:
                raise UnknownNameError("reset option", name, RESET_OPTIONS)
        mask = options.pop("reset_mask", None)
        if mask is None:
            ids = np.arange(self.num_envs)
        else:
            mask = np.asarray(mask)
            if mask.shape != (self.num_envs,) or mask.dtype != bool:
                raise InvalidOptionError(f"reset_mask must be ({self.num_envs},) bool.")
            if not self._started and not mask.all():
                raise InvalidOptionError("reset_mask: the first reset must start every simulation.")
            ids = np.flatnonzero(mask)
        self._start(ids, **options)
        self._started = True

    def step(
        self, actions: np.ndarray
    ) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advances all simulations by a control step.

        Args:
            actions: (N, n); clipped to the action space. A simulation with a NaN or infinite action
                counts as diverged.

        Returns:
            Observations, rewards, terminated, truncated, infos.

        Raises:
            InvalidDataError: The actions have another shape, or are no numbers.
        """
        actions = real_array(type(self).__name__, "actions", actions)
        if actions.shape != self.action_space.shape:
            raise InvalidDataError(
                type(self).__name__, "actions", f"{self.action_space.shape}", f"{actions.shape}"
            )
        judged = self.advance(actions)
        flags = judged.flags
        rows = [*judged.figures, *[flags[k] for k in self._task.flag_rows], *self._place()]
        infos = self._infos.of(rows)
        if judged.some_done and self.autoreset_mode is AutoresetMode.SAME_STEP:
            done = judged.done.copy()
            add_finals(infos, self._infos.masked(infos, done), self.observations, done)
            self._start(done.nonzero()[0])
            infos.update(zip(PLACE, self._place(), strict=True))
        observations = copied(self.observations)
        return observations, judged.reward, judged.terminated, judged.truncated, infos

    def advance(self, actions: np.ndarray) -> Judged:
        """Advances all simulations by a control step, and starts none anew.

        What comes next is in ``observations``.

        Args:
            actions: (N, n) float64, contiguous.
        """
        if not self._started:
            raise InvalidOptionError("step: call reset first.")
        episodes, simulation = self._episodes, self.simulation
        action, bad, some_bad = self.aim(actions)
        diverged = simulation.step()
        if some_bad or simulation.exploded:
            diverged |= bad
            self._record_divergence(diverged.nonzero()[0])
        frame = episodes.frame.copy() if self.sampler.adapts else episodes.frame
        judged = self._task.settle(
            simulation,
            episodes,
            action,
            diverged,
            self._gate.open,
            self.np_random,
            self.observations,
        )
        if self.sampler.adapts:
            failed = (judged.terminated & ~self._over).nonzero()[0]
            self.sampler.record(episodes.motion[failed], frame[failed])
        if judged.some_done:
            # An episode counts once, however long nobody resets its simulation.
            finished = (judged.done & ~self._over).nonzero()[0]
            self._over |= judged.done
            lasted = episodes.elapsed[finished], episodes.possible[finished]
            self._gate.record(*lasted)
            self._noise.record(*lasted)
            self._task.noise_share = self._noise.observed
        if judged.push_due:
            self._push(judged.done)
        return judged

    def aim(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
        """Writes the joint targets of actions into the simulations.

        Args:
            actions: (N, n) float64.

        Returns:
            (N, n) standard actions with the same joint targets: what is rewarded and observed means
            the same in all modes, and for an exported policy; (N,) which actions are NaN or
            infinite, and count as zero; whether any is.
        """
        episodes = self._episodes
        action, bad = np.empty_like(actions), np.empty(self.num_envs, bool)
        some_bad = kernels.joint_targets(
            actions,
            self._limit,
            self._lead,
            episodes.rows,
            episodes.default,
            self._scale,
            action,
            self.simulation.ctrl,
            bad,
        )
        return action, bad, some_bad

    def render(self) -> tuple[np.ndarray, ...] | None:
        """Returns one (height, width, 3) uint8 picture per simulation, the reference as a ghost."""
        if self.render_mode is None:
            return None
        return tuple(self.render_one(i) for i in range(self.num_envs))

    def render_one(self, index: int = 0) -> np.ndarray:
        """Returns a (height, width, 3) uint8 picture of one simulation and its reference."""
        if not self._started:
            raise InvalidOptionError("render: call reset first.")
        scene = int(self._scene_of[self._episodes.motion[index]])
        frames = self._library.frames(self._episodes.rows)
        return self._pictures.render(scene, self.simulation.qpos[index], frames, index)

    def close_extras(self, **kwargs: Any) -> None:
        """Frees the graphics context."""
        self._pictures.close()

    def _start(
        self,
        ids: np.ndarray,
        motion: int | np.ndarray | None = None,
        frame: int | np.ndarray | None = None,
    ) -> None:
        """Puts simulations into start frames, drawn where not given, and observes them."""
        if not len(ids):
            return
        rng, task, episodes = self.np_random, self._task, self._episodes
        self._over[ids] = False
        # All chance of a start in one draw: frame, model, share of the noise, clocks, state.
        draws = rng.random((4 + episodes.draws + task.draws, len(ids)))
        motions, places = self.sampler.draw(draws[:2])
        if frame is not None or motion is not None:
            motions, places = self._library.places(motion, frame, len(ids))
        simulation, rest = self.simulation, 4 + episodes.draws
        simulation.reset(ids, self._variants.choose(self._scene_of, motions, draws[2]))
        episodes.start(ids, motions, places, draws[4:rest])
        share = self._noise.shares(draws[3])
        task.begin(simulation, episodes, ids, draws[rest:], share, rng, self.observations)

    def _push(self, done: np.ndarray) -> None:
        due, config = self._episodes.due_pushes(self.np_random), self.config.randomization.push
        due = due[~done[due]]
        if len(due) and config is not None:
            self.simulation.qvel[due, :6] += push(
                self.simulation.qpos[due, 3:7], config, self.np_random
            )
            self._observe(due)

    def _observe(self, ids: np.ndarray) -> None:
        self._task.observe(self.simulation, self._episodes, ids, self.np_random, self.observations)

    def _place(self) -> list[np.ndarray]:
        return [self._episodes.motion.copy(), self._episodes.frame.copy()]

    def single_info(self, judged: Judged | None = None) -> dict[str, Any]:
        """Returns the infos of the first simulation as plain numbers, of a step or of a start."""
        episodes = self._episodes
        place = [episodes.motion.item(0), episodes.frame.item(0)]
        if judged is None:
            return dict(zip(PLACE, place, strict=True))
        flags = judged.flags[:, 0].tolist()
        values = judged.figures[:, 0].tolist()
        values += [flags[k] for k in self._task.flag_rows]
        return dict(zip(self._infos.names, values + place, strict=True))

    def _record_divergence(self, ids: np.ndarray) -> None:
        for i in ids:
            motion, frame = int(self._episodes.motion[i]), int(self._episodes.frame[i])
            self.divergences.append(
                Divergence(int(i), motion, frame, **self.simulation.before(int(i)))
            )
