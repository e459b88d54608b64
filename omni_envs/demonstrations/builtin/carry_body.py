"""How the body carries out the plan of the box carry.

Everything is built from the ground up: footsteps, then the shift of weight between the feet, then
the path of the centre of mass that this support allows (linear inverted pendulum), then the pelvis
that puts the centre of mass of body and box on that path. Hands follow the box, the box follows
the body.
"""

from __future__ import annotations

import numpy as np

from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.carry_plan import (
    BOX_MASS,
    BOX_SIZE,
    HALF_STANCE,
    TURN,
    Plan,
)
from omni_envs.demonstrations.builtin.motion import (
    FootShape,
    balanced_com,
    foot_paths,
    keyframes,
    pressure_points,
    ramp,
    support_weights,
)

# Lengths in m, angles in rad.
_CARRY_AHEAD, _CARRY_HEIGHT = 0.345, 0.88  # box centre from the centre of mass, and over ground
# Palms over the box centre, and ahead of it: a box whose load is not in its middle tips towards the
# body, which holds it, and not over its far edge when it is put down.
_GRIP_UP, _GRIP_AHEAD = 0.12, 0.08
# The hands come down wide of the box and close on it from the sides: whoever copies this with a box
# that is somewhat wider, or stands somewhat beside its place, does not land on top of it.
_OPEN, _ABOVE = 0.15, 0.2  # beside the faces, and above the grip, before they come down; m
_GRIP_DOWN = np.deg2rad(32.0)  # fingers below the horizontal while gripping
_STAND, _WALK, _SQUAT = 0.920, 0.907, 0.520  # pelvis heights
_LEAN = np.deg2rad(62.0)  # of the chest at the bottom of the squat
_CLEARANCE = 0.075  # of a swinging foot
_COM_HEIGHT = 0.93


def perform(plan: Plan, time: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Performs the plan.

    Args:
        plan: What to do.
        time: (T,) even times, s.

    Returns:
        Joints of ``human.JOINTS`` to (T, 3) positions, box positions (T, 3), box yaw (T,).
    """
    start = [(0.0, HALF_STANCE), (0.0, -HALF_STANCE)]
    feet = human.Feet(*foot_paths(time, plan.steps, start, _CLEARANCE, FootShape()))
    carry_steps = [s for s in plan.steps if plan.lift[1] < s.lift < plan.lower[0]]
    yaw = TURN * ramp(time, carry_steps[0].lift - 0.1, carry_steps[-1].land)
    forward = np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
    left = np.stack([-np.sin(yaw), np.cos(yaw)], axis=-1)

    # The weight, and so the zero-moment point, is under the standing feet; a squat leans forward.
    right = support_weights(time, plan.steps)
    low = ramp(time, *plan.squat) - ramp(time, *plan.lift)
    low += ramp(time, *plan.lower) - ramp(time, *plan.rise)
    heading = np.stack([np.cos(feet.yaw), np.sin(feet.yaw)], axis=-1)
    behind = pressure_points(time, plan.steps) - 0.02 * low[:, None]
    soles = feet.toes[..., :2] - behind[..., None] * heading
    zmp = (1 - right)[:, None] * soles[:, 0] + right[:, None] * soles[:, 1]
    com = balanced_com(zmp, time[1] - time[0], _COM_HEIGHT)

    load = ramp(time, plan.grasp, plan.grasp + 0.3) - ramp(time, plan.release - 0.3, plan.release)

    # Stride: how far the left foot is ahead of the right, along the heading.
    apart = feet.toes[:, 0, :2] - feet.toes[:, 1, :2]
    stride = np.einsum("ti,ti->t", apart, forward)
    walking = keyframes(
        time,
        [(0.2, 0.0), (0.8, 1.0), (plan.squat[0] - 0.3, 1.0), (plan.squat[0], 0.0),
         (plan.lift[1], 0.0), (plan.lift[1] + 0.3, 1.0), (plan.lower[0] - 0.2, 1.0),
         (plan.lower[0] + 0.3, 0.0), (plan.rise[1] - 0.1, 0.0), (plan.rise[1] + 0.3, 1.0),
         (plan.end - 0.6, 1.0), (plan.end - 0.1, 0.0)],
    )  # fmt: skip
    height = _STAND - (_STAND - _WALK) * walking - 0.13 * stride**2
    height += (_SQUAT - height) * low

    # Pelvis and chest: lean, sway and counter-rotation.
    middle = 0.5 * (soles[:, 0] + soles[:, 1])
    carrying = ramp(time, *plan.lift) - ramp(time, *plan.lower)
    sway = np.einsum("ti,ti->t", com - middle, left) / 0.05
    lean = _LEAN * low * (1.5 - 0.5 * low)  # hips go back before the knees come forward
    lean += np.deg2rad(3.0) * walking * (1 - carrying) - np.deg2rad(2.0) * carrying
    free = 1 - carrying - low
    pelvis_turn = np.stack(
        [yaw - 0.16 * stride * (1 - 0.4 * carrying), 0.7 * lean, 0.035 * sway], axis=-1
    )
    chest_turn = np.stack([yaw + 0.14 * stride * free, lean, -0.012 * sway], axis=-1)
    head_turn = np.stack([yaw, 0.25 * lean + 0.12 + 0.22 * low, 0 * yaw], axis=-1)

    box, box_yaw = _box_path(plan, time, com, forward, yaw)
    knees_out = np.deg2rad(6.0 + 10.0 * low)
    pelvis = np.concatenate([com, height[:, None]], axis=1)
    for _ in range(12):  # shift the pelvis until the common centre of mass is where it must be
        joints = human.torso(pelvis, pelvis_turn, chest_turn, head_turn, 0.04 * low)
        human.add_legs(joints, feet, knees_out)
        human.add_arms(joints, _hands(plan, time, joints, chest_turn, stride, box, box_yaw))
        mass = human.MASS + load * BOX_MASS
        common = human.MASS * human.centre_of_mass(joints)[:, :2]
        common += (load * BOX_MASS)[:, None] * box[:, :2]
        pelvis = pelvis.copy()
        pelvis[:, :2] += com - common / mass[:, None]
    return joints, box, box_yaw


def _box_path(
    plan: Plan, time: np.ndarray, com: np.ndarray, forward: np.ndarray, yaw: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Box centre (T, 3) and yaw (T,): at rest, carried ahead of the body, at rest."""
    up = ramp(time, plan.lift[0], plan.lift[1]) - ramp(time, plan.lower[0], plan.lower[1])
    # It leaves the ground straight up, and comes down so.
    near = ramp(time, plan.lift[0] + 0.25, plan.lift[1] + 0.1)
    near = near - ramp(time, plan.lower[0] - 0.1, plan.lower[1] - 0.25)
    after = time > 0.5 * (plan.lift[1] + plan.lower[0])
    rest = np.where(after[:, None], plan.box_end, plan.box_start)
    carried = com + _CARRY_AHEAD * forward
    ground = 0.5 * BOX_SIZE[2]
    box = np.empty((len(time), 3))
    box[:, :2] = rest + near[:, None] * (carried - rest)
    box[:, 2] = ground + up * (_CARRY_HEIGHT - ground)
    return box, yaw


def _hands(
    plan: Plan,
    time: np.ndarray,
    joints: dict[str, np.ndarray],
    chest_turn: np.ndarray,
    stride: np.ndarray,
    box: np.ndarray,
    box_yaw: np.ndarray,
) -> human.Hands:
    """Arms that swing with the stride, reach beside the box, hold it and let go."""
    reach = ramp(time, plan.squat[1] - 0.95, plan.squat[1] - 0.15)
    reach -= ramp(time, plan.rise[0] - 0.05, plan.rise[0] + 0.7)
    close = ramp(time, plan.squat[1] - 0.05, plan.grasp) - ramp(
        time, plan.release, plan.release + 0.4
    )
    above = _ABOVE * (1 - ramp(time, plan.squat[1] - 0.5, plan.squat[1] + 0.1))
    low = ramp(time, *plan.squat) - ramp(time, *plan.rise)
    yaw = chest_turn[:, 0]
    body, crate = human.turn(yaw), human.turn(box_yaw)
    wrists, fingers, palms, poles = np.empty((4, len(time), 2, 3))
    for i, sign in enumerate((1.0, -1.0)):
        shoulder = joints[f"{'LR'[i]}_Shoulder"]
        # Hanging and swinging: the arm opposite to the leading leg swings forward.
        swing = np.deg2rad(-2.0) - sign * 0.65 * stride
        bend = np.deg2rad(20.0) + 0.5 * swing + 3.2 * reach * (1 - reach)
        out = np.deg2rad(9.0)
        upper = np.stack(
            [np.sin(swing), np.full_like(swing, sign * np.sin(out)), -np.cos(swing)], axis=-1
        )
        lower = np.stack(
            [np.sin(swing + bend), np.full_like(swing, sign * 0.04), -np.cos(swing + bend)], axis=-1
        )
        upper, lower = _unit(upper), _unit(lower)
        hanging = shoulder + np.einsum(
            "tij,tj->ti", body, human.UPPER_ARM * upper + human.FOREARM * lower
        )
        # On the box: palm on the side face, fingers forward and down.
        grip_fingers = crate @ np.array([np.cos(_GRIP_DOWN), 0.0, -np.sin(_GRIP_DOWN)])
        inward = crate @ np.array([0.0, -sign, 0.0])
        gap = 0.5 * BOX_SIZE[1] + _OPEN * (1 - close)
        palm = box - gap[:, None] * inward + _GRIP_AHEAD * crate @ np.array([1.0, 0.0, 0.0])
        palm[:, 2] += _GRIP_UP + above
        gripping = palm - human.PALM * grip_fingers - human.PALM_DEPTH * inward
        w = reach[:, None]
        wrists[:, i] = hanging + w * (gripping - hanging)
        fingers[:, i] = _unit((1 - w) * np.einsum("tij,tj->ti", body, lower) + w * grip_fingers)
        across = body @ np.array([0.0, -sign, 0.0])
        palm_normal = (1 - w) * across + w * inward
        along = np.sum(palm_normal * fingers[:, i], axis=-1, keepdims=True)
        palms[:, i] = _unit(palm_normal - along * fingers[:, i])
        back = body @ np.array([-1.0, 0.25 * sign, -0.3])
        aside = body @ np.array([-0.4, 0.35 * sign, -0.6])
        poles[:, i] = back + low[:, None] * (aside - back)
    return human.Hands(wrists, fingers, palms, poles)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)
