"""A run directory → a policy file, proved before it is called done."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from omni_envs.errors import UnknownNameError
from omni_envs.training.config import TrainConfig

PROFILES = ("beyondmimic", "holosoma", "unitree")


def export_run(
    run: str | Path,
    *,
    profile: str = "beyondmimic",
    out: str | Path | None = None,
    described: TrainConfig | None = None,
) -> dict[str, Any]:
    """Exports the newest checkpoint of a run, with a sidecar ``.json`` beside the file.

    The file's signature is checked, its outputs are compared with the network's at several time
    steps, and it plays the same episodes as the network. A file that fails is removed.

    Args:
        run: Run directory.
        profile: Convention of the file.
        out: The file, by default ``RUN/policy.onnx``, of another profile than ``beyondmimic``
            ``RUN/<profile>/policy.onnx``.
        described: What the file says about its training, by default the run's configuration.

    Returns:
        ``path``, ``sidecar``, ``parity_max_abs``, ``closed_loop_return``,
        ``closed_loop_return_network``, ``steps``.

    Raises:
        UnknownNameError: There is no such profile.
        InvalidOptionError: The profile's stack would feed the policy with something else than it
            was trained on.
        FileFormatError: Configuration or checkpoint is missing or damaged.
        InvalidDataError: The file does not do what the network does.
        MissingDependencyError: A package of the extra ``export`` is not installed.
    """
    if profile not in PROFILES:
        raise UnknownNameError("profile", profile, PROFILES)
    from omni_envs.export.closed_loop import closed_loop
    from omni_envs.export.description import describe
    from omni_envs.export.parity import parity
    from omni_envs.export.profiles import WRITERS
    from omni_envs.training.checkpoint import Checkpoint
    from omni_envs.training.evaluate import make_evaluation_env
    from omni_envs.training.network_policy import NetworkPolicy, find_checkpoint, load_actor
    from omni_envs.training.onnx_policy import OnnxPolicy

    run = Path(run)
    config = TrainConfig.load(run)
    told = described or config
    checkpoint = find_checkpoint(run)
    steps = Checkpoint.load(checkpoint).steps
    folder = run if profile == PROFILES[0] else run / profile
    path = Path(out) if out is not None else folder / "policy.onnx"
    env = make_evaluation_env(config, 1)
    try:
        description = describe(env)
    finally:
        env.close()
    actor = load_actor(checkpoint)
    graph = WRITERS[profile].graph(actor, description)
    files = WRITERS[profile].write(graph, description, path, str(told.out))
    try:
        file = OnnxPolicy(path)
        loop = closed_loop(config, NetworkPolicy(actor), file)
        difference = parity(graph, file, loop.observations)
    except BaseException:
        for written in files:
            written.unlink(missing_ok=True)
        raise
    figures = {
        "parity_max_abs": difference,
        "closed_loop_return": loop.file_return,
        "closed_loop_return_network": loop.network_return,
        "steps": steps,
    }
    sidecar = path.with_suffix(".json")
    content = {
        "profile": profile,
        "files": [written.name for written in files],
        **description.sidecar(graph.terms),
        "checks": figures,
        "command": told.command(),
        "training": told.to_dict(),
    }
    sidecar.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n")
    return {"path": str(path), "sidecar": str(sidecar), **figures}
