"""Looking at a policy: a rollout in the physics, the reference beside it as a ghost."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

Act = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Observations (1, ·) at reference frames (1,) → actions (1, n)."""


@dataclass(frozen=True)
class Rollout:
    """One episode, seen.

    Attributes:
        pictures: One per rendered control step.
        fps: Pictures per second of the motion.
        steps: Control steps of the episode.
        terminated: Whether a termination criterion ended it.
    """

    pictures: tuple[np.ndarray, ...]
    fps: float
    steps: int
    terminated: bool


def watch(
    env_id: str,
    act: Act,
    *,
    env_options: Mapping[str, Any] | None = None,
    frame: int = 0,
    every: int = 2,
    width: int = 480,
    height: int = 400,
) -> Rollout:
    """Plays one episode of the first motion.

    Args:
        env_id: Environment id.
        act: The policy.
        env_options: Options of the environment.
        frame: Reference frame to start at.
        every: Renders one of so many control steps.
        width: Pixels.
        height: Pixels.

    Returns:
        What was seen.
    """
    env = gymnasium.make(
        env_id, render_mode="rgb_array", width=width, height=height, **(env_options or {})
    )
    try:
        observation, info = env.reset(seed=0, options={"motion": 0, "frame": frame})
        pictures, steps, terminated, truncated = [env.render()], 0, False, False
        while not (terminated or truncated):
            seen = observation["policy"] if isinstance(observation, Mapping) else observation
            action = act(np.asarray(seen)[None], np.array([info["frame"]]))[0]
            observation, _, terminated, truncated, info = env.step(action)
            steps += 1
            if steps % every == 0 or terminated:
                pictures.append(env.render())
        control_step = env.unwrapped.control_step  # type: ignore[attr-defined]
    finally:
        env.close()
    return Rollout(tuple(pictures), 1.0 / (control_step * every), steps, terminated)  # type: ignore[arg-type]
