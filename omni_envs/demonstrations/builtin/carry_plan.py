"""What happens when in the box carry: footsteps, phases, where the box stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.motion import Step

BOX_SIZE = (0.26, 0.36, 0.32)
"""Depth, width between the hands, height of the box, m."""

BOX_MASS = 1.5
"""kg"""

TURN = np.deg2rad(25.0)
"""Heading of the second half, rad."""

HALF_STANCE = 0.095
"""Half the distance between the feet, m."""

# Box centre ahead of the ankles when it stands on the ground, m. At 0.43 the knees of G1 passed it
# by 8 mm: they knocked a box that is 10 % larger, or 5 cm nearer, out of its hands. The farther it
# is, the more of the waist's torque it takes: 79 % at 0.43, 97 % at 0.49 with as quick a lift.
_REACH = 0.47
_LIFT = 2.0  # time to lift the box, and to put it down, s


@dataclass(frozen=True)
class Plan:
    """Footsteps, times of the phases (s), places of the box (m).

    Attributes:
        steps: In the order of time.
        squat: Going down to the box, start and end.
        grasp: Palms close on the box.
        lift: Coming up with it.
        lower: Putting it down.
        release: Palms leave the box.
        rise: Coming up without it.
        end: Length of the motion.
        box_start: (x, y) where the box stands at first.
        box_end: (x, y) where it is put down.
    """

    steps: tuple[Step, ...]
    squat: tuple[float, float]
    grasp: float
    lift: tuple[float, float]
    lower: tuple[float, float]
    release: float
    rise: tuple[float, float]
    end: float
    box_start: tuple[float, float]
    box_end: tuple[float, float]


def plan_box_carry() -> Plan:
    """Returns the plan: up to the box, round the turn with it, two steps back from it."""
    steps: list[Step] = []

    def walk(start: float, centres: list[tuple[float, float, float]], first: int, period: float,
             swing: float, heel_off: float = 0.30, heel_strike: float = 0.14) -> float:  # fmt: skip
        for i, (x, y, yaw) in enumerate(centres):
            foot = (first + i) % 2
            side = HALF_STANCE if foot == 0 else -HALF_STANCE
            ball = x - side * np.sin(yaw), y + side * np.cos(yaw)
            small = 0.6 if i in (0, len(centres) - 1) else 1.0
            lift = start + i * period
            steps.append(
                Step(foot, lift, lift + swing, ball, yaw, small * heel_off, small * heel_strike)
            )
        return start + (len(centres) - 1) * period + swing

    t = walk(0.75, [(0.29, 0, 0), (0.62, 0, 0), (0.91, 0, 0), (0.91, 0, 0)], 0, 0.64, 0.48)
    squat = t + 0.05, t + 1.35
    grasp = squat[1] + 0.35
    lift = grasp + 0.10, grasp + 0.10 + _LIFT
    t = lift[1] + 0.25
    x, y = 0.91, 0.0
    centres = []
    for length, heading in ((0.28, 0.3), (0.32, 0.7), (0.28, 1.0), (0.0, 1.0)):
        x += length * np.cos(heading * TURN)
        y += length * np.sin(heading * TURN)
        centres.append((x, y, heading * TURN))
    t = walk(t, centres, 0, 0.66, 0.48, 0.30)
    lower = t + 0.05, t + 0.05 + _LIFT
    release = lower[1] + 0.10
    # The hands are open by then: those that were not yet took tilted boxes along.
    rise = release + 0.60, release + 1.90
    t = rise[1] + 0.15
    back = [(x - s * np.cos(TURN), y - s * np.sin(TURN), TURN) for s in (0.20, 0.20)]
    t = walk(t, back, 0, 0.62, 0.46, 0.20, 0.0)
    ahead = _REACH + human.ANKLE_FROM_TOE[0]
    return Plan(
        steps=tuple(steps),
        squat=squat,
        grasp=grasp,
        lift=lift,
        lower=lower,
        release=release,
        rise=rise,
        end=t + 0.60,
        box_start=(0.91 + ahead, 0.0),
        box_end=(x + ahead * np.cos(TURN), y + ahead * np.sin(TURN)),
    )
