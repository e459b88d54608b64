"""The average of an actor over its newest updates: what is evaluated, exported and published.

Every update of PPO follows a noisy gradient, so that the newest weights lie about a better mean
(Polyak and Juditsky 1992). Training itself goes on from the newest.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

_CRITIC = ("mlp_extractor.critic", "value_net.")
_SHARE = 10
"""At first the average is over a tenth of the updates so far: early ones know nothing."""


class WeightAverage:
    """Exponential average of the weights of an actor.

    Args:
        updates: Updates that it is about over; a weight decays by 1/e in so many.
        state: A ``state`` to go on from.
    """

    def __init__(self, updates: int, state: Mapping[str, Any] | None = None) -> None:
        self._over = updates
        self._seen = int(state["updates"]) if state else 0
        self._weights: dict[str, Tensor] = dict(state["weights"]) if state else {}

    @property
    def state(self) -> dict[str, Any]:
        """``updates`` seen so far and the averaged ``weights``, under the names of the policy's."""
        return {"updates": self._seen, "weights": self._weights}

    def update(self, policy: Mapping[str, Tensor]) -> None:
        """Takes in the weights after an update.

        Args:
            policy: Weights and statistics of actor and critic; the latter are left out.
        """
        actor = {k: v.detach().cpu() for k, v in policy.items() if not k.startswith(_CRITIC)}
        share = max(1.0 / self._over, _SHARE / (self._seen + _SHARE))
        for name, new in actor.items():
            old = self._weights.get(name)
            # Numbers of samples are counts, not weights.
            if old is None or not new.is_floating_point():
                self._weights[name] = new.clone()
            else:
                self._weights[name] = torch.lerp(old, new, share)
        self._seen += 1
