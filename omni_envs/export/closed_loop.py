"""Does the file control the robot as the network does?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.errors import InvalidDataError
from omni_envs.training.config import TrainConfig
from omni_envs.training.evaluate import make_evaluation_env
from omni_envs.training.network_policy import NetworkPolicy
from omni_envs.training.onnx_policy import OnnxPolicy
from omni_envs.training.rollout import Policy, play

EPISODES, MAX_STEPS = 4, 250
TOLERANCE = 1e-3
# Contacts amplify the last digits of an action. The network with these changed is what it differs
# from without being another; a file may differ ten times as much.
_LAST_DIGITS, _MARGIN = 1e-6, 10.0


@dataclass(frozen=True)
class ClosedLoop:
    """Returns of the same episodes under file and network.

    Attributes:
        file_return: Mean undiscounted return of the file.
        network_return: That of the network.
        observations: (K, ·) observations that the network saw, from start to end.
    """

    file_return: float
    network_return: float
    observations: np.ndarray


def closed_loop(
    config: TrainConfig, network: NetworkPolicy, file: OnnxPolicy, seed: int = 0
) -> ClosedLoop:
    """Plays the same randomized episodes with network and file, each in its own kind of action.

    Episodes are cut after 250 control steps, before chance decides.

    Args:
        config: The run that they belong to.
        network: The network, in the environment as trained in.
        file: The file, in an environment that takes standard actions.
        seed: Seed of the episodes.

    Raises:
        InvalidDataError: The returns differ by more than 10⁻³ of their size, and by more than ten
            times what a change of the last digits of the network's actions makes.
    """
    seen: list[np.ndarray] = []

    def watched(observations: np.ndarray, frames: np.ndarray) -> np.ndarray:
        seen.append(observations[0].copy())
        return network(observations, frames)

    def returns(policy: Policy, is_file: bool) -> float:
        env = make_evaluation_env(config, EPISODES, file=is_file)
        try:
            return float(play(env, policy, seed=seed, max_steps=MAX_STEPS).returns.mean())
        finally:
            env.close()

    def rounded(observations: np.ndarray, frames: np.ndarray) -> np.ndarray:
        return network(observations, frames) * np.float32(1.0 + _LAST_DIGITS)

    found, expected = returns(file, True), returns(watched, False)
    tolerance = TOLERANCE * max(1.0, abs(expected))
    if abs(found - expected) > tolerance:
        tolerance = max(tolerance, _MARGIN * abs(returns(rounded, False) - expected))
    if not abs(found - expected) <= tolerance:
        raise InvalidDataError(
            str(file.path),
            "return in closed loop",
            f"that of the network, {expected:.6g}, within {tolerance:.2g}",
            f"{found:.6g}",
        )
    return ClosedLoop(found, expected, np.array(seen))
