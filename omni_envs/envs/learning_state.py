"""What finished episodes have taught an environment, to be saved with a training run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from omni_envs.envs.episodes import NoiseLevel, ObjectGate
from omni_envs.errors import InvalidDataError
from omni_envs.tracking.motion_sampling import MotionSampler

FIELDS = ("failures", "gate", "noise")
OWNER = "Learning state"


def learning_state(sampler: MotionSampler, gate: ObjectGate, noise: NoiseLevel) -> dict[str, Any]:
    """Returns the state as JSON-compatible data.

    Returns:
        ``failures``: (bins,) averages of adaptive sampling; ``gate``: ``open``, whether losing the
        object ends an episode, and ``recent``, the shares that the latest episodes lasted;
        ``noise``: ``level`` of the start noise, and ``episodes``, ``lasted`` and ``possible`` since
        it last moved.
    """
    return {"failures": sampler.failures.tolist(), "gate": gate.state(), "noise": noise.state()}


def restore_learning_state(
    state: Mapping[str, Any], sampler: MotionSampler, gate: ObjectGate, noise: NoiseLevel
) -> None:
    """Takes over what ``learning_state`` returned, all of it or, where it does not fit, nothing.

    Args:
        state: From an environment with the same references and options.
        sampler: To change.
        gate: To change.
        noise: To change.

    Raises:
        InvalidDataError: A field is missing, unknown or of another environment.
    """
    _same_fields("fields", state, FIELDS)
    failures = _numbers("failures", state["failures"])
    if failures.shape != sampler.failures.shape:
        raise InvalidDataError(
            OWNER,
            "failures",
            f"of {sampler.num_bins} bins, as the motions have",
            f"{failures.size}",
        )
    for name, part in (("gate", gate), ("noise", noise)):
        _same_fields(name, state[name], part.state())
    recent = _numbers("gate.recent", state["gate"]["recent"])
    counts = _numbers("noise", list(state["noise"].values()))
    if counts.ndim != 1 or recent.ndim != 1 or not 0.0 <= state["noise"]["level"] <= 1.0:
        raise InvalidDataError(OWNER, "gate and noise", "numbers, the level in [0, 1]", f"{state}")
    sampler.restore(failures)
    gate.restore(state["gate"])
    noise.restore(state["noise"])


def _same_fields(name: str, found: Any, expected: Any) -> None:
    if not isinstance(found, Mapping) or set(found) != set(expected):
        what = sorted(found) if isinstance(found, Mapping) else repr(found)
        raise InvalidDataError(OWNER, name, f"a mapping of {sorted(expected)}", f"{what}")


def _numbers(name: str, values: Any) -> np.ndarray:
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError) as error:
        raise InvalidDataError(OWNER, name, "numbers", repr(values)) from error
    if not np.isfinite(array).all() or (array < 0).any():
        raise InvalidDataError(OWNER, name, "finite and not negative", repr(values))
    return array
