"""The single environment: the vector environment with one simulation."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from math import isfinite
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from omni_envs.envs.batches import Observation, real_array, row_of
from omni_envs.envs.options import UnexpectedOptionError
from omni_envs.envs.spec import PlainSpec
from omni_envs.envs.vector_env import RENDER_MODES, OmniVectorEnv
from omni_envs.errors import InvalidDataError

_OWN = ("num_envs", "num_threads", "autoreset_mode")
# Libraries tell a vector environment by these.
_VECTOR_ONLY = (*_OWN, "single_observation_space", "single_action_space", "closed")


class OmniEnv(PlainSpec, gymnasium.Env[Observation, np.ndarray]):
    """A humanoid that tracks a reference motion.

    The code is that of ``OmniVectorEnv`` with one simulation; so are the options. All tables are
    for the G1 and the preset ``paper``; every number is an option, see ``omni_envs.tracking``.

    **Tasks**: an id is ``OmniEnvs/<robot><task>-v0`` for the robots G1, H1 and T1. The default
    reference is made from a built-in demonstration at the first make, and cached; ``reference=``
    takes any other.

    | Task     | Default reference                                         | Leans on           |
    |----------|-----------------------------------------------------------|--------------------|
    | BoxCarry | walks up, lifts a box, carries it, puts it down           | hands, feet        |
    | Climb    | up a platform of 70 % of its height, and down again       | hands, knees, feet |
    | Crawl    | up a slope on hands and knees, and stands on the block    | hands, knees, feet |
    | Track    | none: ``reference=`` is needed                            | hands, feet        |

    **Action**: ``Box(-10, 10, (n,))``. The target of joint j is default_j + scale_j · a_j with
    scale = 0.25 · effort / kp, held for a control step of 0.02 s; with ``action={"mode":
    "residual"}`` the reference's joint position takes the place of the default, with
    ``"feedforward"`` a position ahead of it that makes up for damping and load.

    | Index | Joint                | Default (rad) | Scale (rad) | Effort (N m) |
    |-------|----------------------|---------------|-------------|--------------|
    | 0     | left_hip_pitch       | -0.312        | 0.548       | 88           |
    | 1     | left_hip_roll        | 0             | 0.351       | 139          |
    | 2     | left_hip_yaw         | 0             | 0.548       | 88           |
    | 3     | left_knee            | 0.669         | 0.351       | 139          |
    | 4     | left_ankle_pitch     | -0.363        | 0.439       | 50           |
    | 5     | left_ankle_roll      | 0             | 0.439       | 50           |
    | 6     | right_hip_pitch      | -0.312        | 0.548       | 88           |
    | 7     | right_hip_roll       | 0             | 0.351       | 139          |
    | 8     | right_hip_yaw        | 0             | 0.548       | 88           |
    | 9     | right_knee           | 0.669         | 0.351       | 139          |
    | 10    | right_ankle_pitch    | -0.363        | 0.439       | 50           |
    | 11    | right_ankle_roll     | 0             | 0.439       | 50           |
    | 12    | waist_yaw            | 0             | 0.548       | 88           |
    | 13    | waist_roll           | 0             | 0.439       | 50           |
    | 14    | waist_pitch          | 0             | 0.439       | 50           |
    | 15    | left_shoulder_pitch  | 0.2           | 0.439       | 25           |
    | 16    | left_shoulder_roll   | 0.2           | 0.439       | 25           |
    | 17    | left_shoulder_yaw    | 0             | 0.439       | 25           |
    | 18    | left_elbow           | 0.6           | 0.439       | 25           |
    | 19    | left_wrist_roll      | 0             | 0.439       | 25           |
    | 20    | left_wrist_pitch     | 0             | 0.075       | 5            |
    | 21    | left_wrist_yaw       | 0             | 0.075       | 5            |
    | 22    | right_shoulder_pitch | 0.2           | 0.439       | 25           |
    | 23    | right_shoulder_roll  | -0.2          | 0.439       | 25           |
    | 24    | right_shoulder_yaw   | 0             | 0.439       | 25           |
    | 25    | right_elbow          | 0.6           | 0.439       | 25           |
    | 26    | right_wrist_roll     | 0             | 0.439       | 25           |
    | 27    | right_wrist_pitch    | 0             | 0.075       | 5            |
    | 28    | right_wrist_yaw      | 0             | 0.075       | 5            |

    **Observation**: ``Box(-inf, inf, (160,))``; without state estimation the terms
    ``motion_anchor_pos_b`` and ``base_lin_vel`` are absent, 154 entries. "_b" is the frame of the
    robot's anchor body, orientations are the first two columns of a rotation matrix by rows, noise
    is the half width of a uniform distribution.

    | Index   | Name                | Noise | Unit       | Meaning                                 |
    |---------|---------------------|-------|------------|-----------------------------------------|
    | 0…57    | command             | 0     | rad, rad/s | reference joints: positions, velocities |
    | 58…60   | motion_anchor_pos_b | 0     | m          | reference anchor seen by the robot's    |
    | 61…66   | motion_anchor_ori_b | 0.05  | –          | its orientation, two columns            |
    | 67…69   | base_lin_vel        | 0.5   | m/s        | root velocity in the root frame         |
    | 70…72   | base_ang_vel        | 0.2   | rad/s      | root rotation in the root frame         |
    | 73…101  | joint_pos           | 0.01  | rad        | joint positions minus default           |
    | 102…130 | joint_vel           | 0.5   | rad/s      | joint velocities                        |
    | 131…159 | actions             | 0     | –          | previous action                         |

    With ``observation={"privileged": True}`` the observation is a dictionary: ``policy`` as above
    and ``critic``, without noise, which goes on with

    | Index   | Name          | Noise | Unit | Meaning                               |
    |---------|---------------|-------|------|---------------------------------------|
    | 160…201 | body_pos_b    | 0     | m    | tracked bodies in the anchor frame    |
    | 202…285 | body_ori_b    | 0     | –    | their orientation, two matrix columns |
    | 286…288 | obj_pos_b     | 0     | m    | object in the anchor frame            |
    | 289…294 | obj_ori_b     | 0     | –    | its orientation, two matrix columns   |
    | 295…297 | obj_lin_vel_b | 0     | m/s  | its velocity, in the anchor's axes    |

    **Reward**: the sum of the terms times 0.02 s. A tracking term is weight · exp(-e / σ²), e a
    squared error, for bodies its mean over the tracked bodies; the body terms compare with the
    reference moved to the robot's anchor in x, y and yaw.

    | Term                  | Weight / s | σ          |
    |-----------------------|------------|------------|
    | anchor_position       | 0.5        | 0.3 m      |
    | anchor_orientation    | 0.5        | 0.4 rad    |
    | body_position         | 1          | 0.3 m      |
    | body_orientation      | 1          | 0.4 rad    |
    | body_linear_velocity  | 1          | 1 m/s      |
    | body_angular_velocity | 1          | 3.14 rad/s |
    | object_position       | 1          | 0.3 m      |
    | object_orientation    | 1          | 0.4 rad    |
    | action_rate           | -0.1       | –          |
    | joint_limit           | -10        | –          |
    | contact               | -0.1       | –          |

    **End of an episode**: heights are compared with the reference's, the tilt is the difference of
    the z parts of projected gravity. The object test waits until the body is tracked reasonably,
    see ``termination.object_after``.

    | Test                | Threshold             | Episode is |
    |---------------------|-----------------------|------------|
    | anchor_height       | 0.25 m                | terminated |
    | anchor_tilt         | 0.8                   | terminated |
    | end_effector_height | 0.25 m                | terminated |
    | object              | 1 m or 0.785 rad      | terminated |
    | diverged            | a numerical explosion | terminated |
    | motion end          | the last frame        | truncated  |
    | max_seconds         | 10 s                  | truncated  |

    **Start**: in a frame of the reference, disturbed, see ``reset``. The frame after it is the
    first to be tracked. ``reset(options={"motion": m, "frame": k})`` starts in a given frame.

    **Info**:

    | Key                         | Unit  | Meaning                                          |
    |-----------------------------|-------|--------------------------------------------------|
    | reward/<term>               | –     | weighted term of the reward, times 0.02 s        |
    | error/anchor_position       | m     | distance of the anchor from the reference's      |
    | error/anchor_orientation    | rad   | angle between them                               |
    | error/body_position         | m     | distance of the tracked bodies, root mean square |
    | error/body_orientation      | rad   | angle between them, root mean square             |
    | error/body_linear_velocity  | m/s   | their velocities' difference, root mean square   |
    | error/body_angular_velocity | rad/s | their rotations' difference, root mean square    |
    | error/object_position       | m     | distance of the object from the reference's      |
    | error/object_orientation    | rad   | angle between them                               |
    | terminated/<test>           | bool  | test was hit: the first four above               |
    | diverged                    | bool  | simulation exploded                              |
    | motion                      | –     | motion that is tracked next, in the order given  |
    | frame                       | –     | its frame that is tracked next                   |

    Terms and tests that an option switches off, and those of the object without one, are absent.

    Version history:
        v0: First version.

    Args:
        **options: Options of ``OmniVectorEnv`` but ``num_envs``, ``num_threads`` and
            ``autoreset_mode``.

    Raises:
        OmniEnvsError: An option or reference is not valid; the message names it.
    """

    # gymnasium.make reads the class before there is an instance.
    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012

    def __init__(self, **options: Any) -> None:
        valid = [
            p for p in inspect.signature(OmniVectorEnv).parameters if p not in (*_OWN, "unknown")
        ]
        for name in options:
            if name not in valid:
                raise UnexpectedOptionError.of(type(self).__name__, name, valid)
        self.vector = OmniVectorEnv(
            1, num_threads=1, autoreset_mode=AutoresetMode.DISABLED, **options
        )
        self.metadata = {k: v for k, v in self.vector.metadata.items() if k != "autoreset_mode"}
        self.render_mode = self.vector.render_mode
        self.observation_space = self.vector.single_observation_space
        self.action_space = self.vector.single_action_space

    def __getattr__(self, name: str) -> Any:
        """Attributes of the vector environment, such as ``robot`` or ``policy_layout``."""
        if name.startswith("_") or name == "vector" or name in _VECTOR_ONLY:
            raise AttributeError(name)
        return getattr(self.vector, name)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode; see ``OmniVectorEnv.reset`` for the options."""
        super().reset(seed=seed)
        self.vector.restart(seed, options)
        self._np_random = self.vector.np_random
        return row_of(self.vector.observations), self.vector.single_info()

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advances by a control step.

        Raises:
            InvalidDataError: The action has another shape, is no numbers, or has a NaN or infinite
                entry.
        """
        owner = type(self).__name__
        action = real_array(owner, "action", action)
        if action.shape != self.action_space.shape:
            expected = f"an array {self.action_space.shape}"
            raise InvalidDataError(owner, "action", expected, f"{action.shape}")
        # The product is finite if all entries are and none is huge, and quicker to look at.
        if not isfinite(action.dot(action)) and not np.isfinite(action).all():
            bad = int(np.flatnonzero(~np.isfinite(action))[0])
            raise InvalidDataError(owner, f"action[{bad}]", "finite", f"{action[bad]}")
        vector = self.vector
        judged = vector.advance(action[None])
        return (
            row_of(vector.observations),
            judged.reward.item(),
            judged.terminated.item(),
            judged.truncated.item(),
            vector.single_info(judged),
        )

    def render(self) -> np.ndarray | None:
        """Returns a (height, width, 3) uint8 picture, the reference as a ghost."""
        return None if self.render_mode is None else self.vector.render_one()

    def close(self) -> None:
        """Frees the graphics context."""
        self.vector.close()
