"""The figures of the environment as tables, made from the code that uses them."""

from __future__ import annotations

from collections.abc import Sequence

from omni_envs.robots import G1, Robot
from omni_envs.tracking.config import PRESETS, TrackingTerm
from omni_envs.tracking.observations import ObservationTerm, critic_layout, policy_layout
from omni_envs.tracking.rewards import PENALTY_TERMS, TRACKING_TERMS

_ERROR_UNITS = ("m", "rad", "m", "rad", "m/s", "rad/s", "m", "rad")
_ERRORS = (
    "distance of the anchor from the reference's",
    "angle between them",
    "distance of the tracked bodies, root mean square",
    "angle between them, root mean square",
    "their velocities' difference, root mean square",
    "their rotations' difference, root mean square",
    "distance of the object from the reference's",
    "angle between them",
)


def observation_table(robot: Robot = G1, preset: str = "paper") -> str:
    """Returns the policy's observation: index, name, noise, unit, meaning."""
    layout = policy_layout(PRESETS[preset].observation, robot.num_joints)
    return _observation_table(layout.terms)


def action_table(robot: Robot = G1) -> str:
    """Returns the joints: index, name, default position, what an action of 1 adds, effort limit."""
    scale = robot.action_scale
    rows = [
        (
            f"{i}",
            name.removesuffix("_joint"),
            f"{robot.default_joint_array[i]:g}",
            f"{scale[i]:.3f}",
            f"{robot.actuators[i].effort:g}",
        )
        for i, name in enumerate(robot.joint_names)
    ]
    return _table(("Index", "Joint", "Default (rad)", "Scale (rad)", "Effort (N m)"), rows)


def info_table() -> str:
    """Returns what the infos of a step hold: key, unit, meaning."""
    rows = [
        ("reward/<term>", "–", "weighted term of the reward, times 0.02 s"),
        *zip([f"error/{n}" for n in TRACKING_TERMS], _ERROR_UNITS, _ERRORS, strict=True),
        ("terminated/<test>", "bool", "test was hit: the first four above"),
        ("diverged", "bool", "simulation exploded"),
        ("motion", "–", "motion that is tracked next, in the order given"),
        ("frame", "–", "its frame that is tracked next"),
    ]
    return _table(("Key", "Unit", "Meaning"), rows)


def critic_table(robot: Robot = G1) -> str:
    """Returns what the privileged observation has beyond the policy's, with an object."""
    layout = critic_layout(robot.num_joints, len(robot.tracked_bodies), has_object=True)
    seen = policy_layout(PRESETS["paper"].observation, robot.num_joints).names
    return _observation_table([t for t in layout.terms if t.name not in seen])


def reward_table(preset: str = "paper") -> str:
    """Returns the reward terms: name, weight per second, σ."""
    reward = PRESETS[preset].reward
    rows = []
    for name, unit in zip(TRACKING_TERMS, _ERROR_UNITS, strict=True):
        term = getattr(reward, name)
        if isinstance(term, TrackingTerm):
            rows.append((name, f"{term.weight:g}", f"{term.sigma:g} {unit}"))
    rows += [(name, f"{getattr(reward, name):g}", "–") for name in PENALTY_TERMS]
    return _table(("Term", "Weight / s", "σ"), rows)


def termination_table(preset: str = "paper") -> str:
    """Returns what ends an episode: test, threshold, kind."""
    t = PRESETS[preset].termination
    rows = [
        ("anchor_height", f"{t.anchor_height:g} m", "terminated"),
        ("anchor_tilt", f"{t.anchor_tilt:g}", "terminated"),
        ("end_effector_height", f"{t.end_effector_height:g} m", "terminated"),
        ("object", f"{t.object_position:g} m or {t.object_angle:.3f} rad", "terminated"),
        ("diverged", "a numerical explosion", "terminated"),
        ("motion end", "the last frame", "truncated"),
        ("max_seconds", f"{t.max_seconds:g} s", "truncated"),
    ]
    return _table(("Test", "Threshold", "Episode is"), rows)


def _observation_table(terms: Sequence[ObservationTerm]) -> str:
    rows = [
        (f"{t.start}…{t.slice.stop - 1}", t.name, f"{t.noise:g}", t.unit, t.meaning) for t in terms
    ]
    return _table(("Index", "Name", "Noise", "Unit", "Meaning"), rows)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    widths = [max(len(r[i]) for r in (head, *rows)) for i in range(len(head))]

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(c.ljust(w) for c, w in zip(cells, widths, strict=True)) + " |"

    rule = "|" + "|".join("-" * (w + 2) for w in widths) + "|"
    return "\n".join([line(head), rule, *map(line, rows)])
