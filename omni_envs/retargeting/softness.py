"""How much a row resists where constraints contradict each other."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.limits import CONTACT, FOOTING, SELF, STANCE

# (quadratic, linear) weights of the violation by kind: each kind outweighs those that give way
# before it, and the cost. The linear part makes the violation zero wherever zero is possible.
_WEIGHTS = {FOOTING: (1e3, 1e0), STANCE: (1e4, 1e1), SELF: (1e6, 1e3), CONTACT: (1e8, 1e5)}
_QUADRATIC = np.array([_WEIGHTS[kind][0] for kind in sorted(_WEIGHTS)])
_LINEAR = np.array([_WEIGHTS[kind][1] for kind in sorted(_WEIGHTS)])


def softness(kind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quadratic and linear weight of the violation of rows: ½ρv² + wv.

    Args:
        kind: (N,) kinds of rows, see ``limits``.

    Returns:
        (N,) ρ and (N,) w.
    """
    return _QUADRATIC[kind], _LINEAR[kind]
