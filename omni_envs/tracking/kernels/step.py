"""A control step's share of the task, each in one call: after physics, after a push, at a start."""

from __future__ import annotations

from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.kernels.compiled import Array, compiled
from omni_envs.tracking.kernels.judgement import judge
from omni_envs.tracking.kernels.kinematics import place_bodies
from omni_envs.tracking.kernels.observation import observe
from omni_envs.tracking.kernels.plan import Clocks, clock_rows, unpack
from omni_envs.tracking.kernels.starts import start_states


@compiled
def advance(
    clocks: Clocks, terminated: Array, ids: Array, out_truncated: Array, out_done: Array
) -> tuple[bool, bool]:
    """Counts a control step of the simulations ``ids`` and moves on to the next frames.

    The last frame of a motion stays. Writes (N,) which episodes are over for lack of motion or time
    alone, and which are over. Returns whether any is, and whether any push is due.
    """
    some, due = False, False
    for i in ids:
        clocks.elapsed[i] += 1
        clocks.next_push[i] -= 1
        clocks.frame[i] = min(clocks.frame[i] + 1, clocks.last[i])
        clocks.rows[i] = clocks.first[i] + clocks.frame[i]
        over = clocks.elapsed[i] >= clocks.possible[i]
        out_truncated[i] = over and not terminated[i]
        out_done[i] = over or terminated[i]
        some |= out_done[i]
        due |= clocks.next_push[i] <= 0
    return some, due


@compiled
def settle(
    integers: Array, reals: Array, table: Array, clocks: Array, qpos: Array, qvel: Array,
    position: Array, quaternion: Array, linear: Array, angular: Array, default: Array,
    action: Array, previous: Array, history: Array, object_active: bool, diverged: Array,
    seed: int, share: float, ids: Array, out_figures: Array, out_flags: Array, out_reward: Array,
    out_policy: Array, out_critic: Array,
) -> tuple[bool, bool]:  # fmt: skip
    """All that follows a control step of physics: bodies, ``judge``, ``advance``, ``observe``.

    ``out_flags`` is (8, N): those of ``judge``, whether any is set, and the two of ``advance``,
    whose result is returned.
    """
    numbers, at, tree = unpack(integers, reals)
    bodies = Bodies(position, quaternion, linear, angular)
    now = clock_rows(clocks)
    place_bodies(tree, qpos, qvel, ids, bodies)
    judge(
        numbers, at, table, now.rows, qpos, bodies, action, previous, history, object_active,
        diverged, ids, out_figures, out_flags, out_reward, out_flags[5],
    )  # fmt: skip
    some, due = advance(now, out_flags[5], ids, out_flags[6], out_flags[7])
    observe(
        numbers, at, table, now.rows, qpos, qvel, bodies, default, action, seed, share, ids,
        out_policy, out_critic,
    )  # fmt: skip
    return some, due


@compiled
def look(
    integers: Array, reals: Array, table: Array, clocks: Array, qpos: Array, qvel: Array,
    position: Array, quaternion: Array, linear: Array, angular: Array, default: Array,
    action: Array, seed: int, share: float, ids: Array, out_policy: Array, out_critic: Array,
) -> None:  # fmt: skip
    """Observes the simulations ``ids``, whose bodies are where they were: see ``observe``."""
    numbers, at, _ = unpack(integers, reals)
    observe(
        numbers, at, table, clock_rows(clocks).rows, qpos, qvel,
        Bodies(position, quaternion, linear, angular), default, action, seed, share, ids,
        out_policy, out_critic,
    )  # fmt: skip


@compiled
def begin(
    integers: Array, reals: Array, table: Array, clocks: Array, qpos: Array, qvel: Array,
    position: Array, quaternion: Array, linear: Array, angular: Array, default: Array,
    action: Array, seed: int, share: float, ids: Array, out_policy: Array, out_critic: Array,
    draws: Array, widths: Array,
) -> None:  # fmt: skip
    """Puts the simulations ``ids`` into start states, and observes them: see ``start_states``.

    They start a frame before the one to track first.
    """
    numbers, at, tree = unpack(integers, reals)
    bodies = Bodies(position, quaternion, linear, angular)
    rows = clock_rows(clocks).rows
    start_states(numbers, at, table, rows, draws, widths, ids, qpos, qvel)
    place_bodies(tree, qpos, qvel, ids, bodies)
    observe(
        numbers, at, table, rows, qpos, qvel, bodies, default, action, seed, share, ids,
        out_policy, out_critic,
    )  # fmt: skip
