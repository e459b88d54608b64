"""Where the network learns: on the CPU or on a GPU. Physics stays on the CPU either way."""

from __future__ import annotations

import math
import os
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any

import torch
from torch import Tensor

from omni_envs.errors import InvalidOptionError, OmniEnvsError


def torch_device(name: str) -> torch.device:
    """Returns the device of a name of ``TrainConfig.device``: ``"auto"`` is a GPU if there is one.

    Raises:
        InvalidOptionError: A GPU was asked for and torch finds none.
    """
    found = torch.cuda.is_available()
    if name == "cuda" and not found:
        raise InvalidOptionError(
            "device: 'cuda' was asked for, but torch finds no GPU that it can use; "
            "choose 'cpu', or 'auto' for a GPU where there is one."
        )
    if name == "cpu" or not found:
        return torch.device("cpu")
    # With its number, as tensors name it: libraries compare devices, and "cuda" is not "cuda:0".
    return torch.device("cuda", torch.cuda.current_device())


def machine(device: torch.device, threads: int = 0) -> str:
    """Returns what trains, in words: the physics threads (0: every core), and the GPU if any."""
    affinity = getattr(os, "sched_getaffinity", None)  # not on every system
    cores = threads or (len(affinity(0)) if affinity else os.cpu_count() or 1)
    words = f"{cores} CPU core{'s' * (cores > 1)}"
    return f"{words}, {torch.cuda.get_device_name(device)}" if device.type == "cuda" else words


def second_worker(device: torch.device) -> Executor:
    """Returns who learns the critic while this thread learns the actor, which share no weights.

    On the CPU another thread: two cores are busy without waiting for each other inside every small
    matrix product. A GPU is kept busy by one thread; there the work is done as it is submitted.
    """
    return ThreadPoolExecutor(1) if device.type == "cpu" else _AtOnce()


class _AtOnce(Executor):
    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        done: Future[Any] = Future()
        done.set_result(fn(*args, **kwargs))
        return done


def device_rng(device: torch.device) -> Tensor | None:
    """Returns the state of a GPU's random generator, or None on the CPU."""
    return torch.cuda.get_rng_state(device) if device.type == "cuda" else None


def restore_rng(
    device: torch.device, cpu_state: Tensor, device_state: Tensor | None, seed: int
) -> None:
    """Puts the random generators back to where a run was.

    Args:
        device: Where the run goes on.
        cpu_state: From ``torch.get_rng_state``.
        device_state: From ``device_rng``; None where the run was on the CPU.
        seed: Seeds the generator of a GPU that has no state to go back to.
    """
    torch.set_rng_state(cpu_state)
    if device.type == "cuda":
        if device_state is None:
            torch.cuda.manual_seed(seed)
        else:
            torch.cuda.set_rng_state(device_state, device)


def read(figures: list[dict[str, Tensor]]) -> list[dict[str, float]]:
    """Returns figures as numbers; on a GPU this waits for all that was asked of it, once.

    Args:
        figures: One mapping of scalars per gradient step, all with the same names.
    """
    if not figures:
        return []
    rows = torch.stack([torch.stack([*row.values()]) for row in figures]).tolist()
    return [dict(zip(row, values, strict=True)) for row, values in zip(figures, rows, strict=True)]


def read_and_clear(taken: list[dict[str, Tensor]], lasted: str) -> list[dict[str, float]]:
    """Reads the figures of the gradient steps that were not read yet, and forgets them.

    Args:
        taken: As ``read`` takes them; empty afterwards.
        lasted: How long training has lasted, in words, for the error.

    Raises:
        OmniEnvsError: A figure is not finite.
    """
    figures = read(taken)
    taken.clear()
    for row in figures:
        if not all(map(math.isfinite, row.values())):
            raise OmniEnvsError(
                f"Training diverged after {lasted}: {row}. "
                "Resume from a checkpoint with a smaller learning rate."
            )
    return figures
