"""Non-penetration of the surroundings and of the robot itself."""

from __future__ import annotations

import mujoco
import numpy as np

from omni_envs.retargeting import kernels
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import CONTACT, SELF, RowLimit, Rows

_KINDS = np.array([CONTACT, SELF])


class ContactLimit(RowLimit):
    """φ_j(q) ≥ -tolerance, linearised: n·(J₂ - J₁) dq ≥ -φ - tolerance (OmniRetarget eq. 4b).

    One broad and narrow phase finds all pairs within the margins, with distance φ and normal n from
    the first to the second geom. Bodies of the surroundings do not move with dq.

    Args:
        tolerance: Accepted depth against the surroundings, m; infinite for none of that limit.
    """

    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns one row per contact point."""
        model, data = configuration.model, configuration.data
        mujoco.mj_collision(model, data)
        if data.ncon == 0:
            return None
        contact = data.contact
        bodies, own, lower = kernels.contact_sides(
            contact.geom, model.geom_bodyid, contact.dist, configuration.ancestors, self._tolerance
        )
        A = configuration.contact_rows(bodies, contact.pos, contact.frame[:, :3])
        return Rows(A, lower, np.full(len(lower), np.inf), _KINDS[own])
