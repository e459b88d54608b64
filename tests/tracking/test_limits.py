from fnmatch import fnmatchcase
from math import inf, nan

import pytest

from omni_envs.errors import InvalidOptionError
from omni_envs.tracking.config import (
    PRESETS,
    ActionConfig,
    PushConfig,
    RandomizationConfig,
    RewardConfig,
    TrackingTerm,
    make_config,
)
from omni_envs.tracking.limits import RULES, _leaves, check_limits


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"reward": {"body_position": {"sigma": 0}}}, "reward.body_position.sigma: .* above 0"),
        ({"reward": {"soft_limit": 2}}, "reward.soft_limit: .*at most 1; got 2.0"),
        ({"reward": {"contact_force": -1}}, "reward.contact_force: expected 0 or more"),
        ({"reward": {"contact": -inf}}, "reward.contact: expected a finite number"),
        ({"termination": {"anchor_height": -0.1}}, "termination.anchor_height: .* above 0"),
        ({"termination": {"max_seconds": 0}}, "termination.max_seconds: .* above 0; got 0.0"),
        ({"termination": {"max_seconds": inf}}, "termination.max_seconds"),
        ({"termination": {"object_after": 1.5}}, "termination.object_after: expected from 0 to 1"),
        ({"observation": {"noise": {"joint_velocity": -1}}}, "observation.noise.joint_velocity"),
        ({"randomization": {"friction": [-1, 1]}}, "randomization.friction: .* the smaller first"),
        ({"randomization": {"push": {"interval": [3, 1]}}}, "randomization.push.interval"),
        ({"randomization": {"push": {"linear": [0, -1, 0]}}}, "randomization.push.linear"),
        ({"randomization": {"object": {"mass": [2, 1]}}}, "object.mass: .*smaller first; got .2.0"),
        ({"randomization": {"object": {"mass": [-1, 1]}}}, "randomization.object.mass"),
        ({"randomization": {"object": {"inertia": [0, 1]}}}, "randomization.object.inertia"),
        ({"randomization": {"object": {"shape": 1.0}}}, "randomization.object.shape"),
        ({"randomization": {"joint_default": -0.1}}, "randomization.joint_default"),
        ({"reset": {"growth": {"share": 2}}}, "reset.growth.share"),
        ({"reset": {"growth": {"step": -1}}}, "reset.growth.step"),
        ({"reset": {"adaptive": {"decay": 1.5}}}, "reset.adaptive.decay"),
        ({"reset": {"adaptive": {"kernel": 0}}}, "reset.adaptive.kernel: expected 1 or more"),
        ({"reset": {"adaptive": {"uniform": 0}}}, "reset.adaptive.uniform"),
        ({"reset": {"noise": {"joint_position": -1}}}, "reset.noise.joint_position"),
        ({"action": {"limit": -1}}, "action.limit"),
        ({"action": ActionConfig(scale=0.0)}, "action.scale"),
        ({"reward": RewardConfig(action_rate=nan)}, "reward.action_rate: expected a finite"),
        ({"reward": RewardConfig(body_position=TrackingTerm(1.0, -1.0))}, "body_position.sigma"),
        ({"randomization": RandomizationConfig(push=PushConfig(interval=(1.0,)))}, "push.interval"),
    ],
)
def test_a_value_outside_its_limits_is_one_clear_error(options, message):
    with pytest.raises(InvalidOptionError, match=r"environment\..*" + message):
        make_config(**options)


def test_limits_themselves_are_allowed():
    make_config(
        reward={"soft_limit": 1.0, "contact_force": 0},
        termination={"object_after": 0.0, "anchor_height": inf},
        randomization={
            "friction": [0, 0],
            "object": {"mass": [1, 1], "shape": 0.0},
            "push": {"linear": [0, 0, 0]},
        },
        reset={"growth": {"share": 0, "step": 1}, "adaptive": {"kernel_decay": 0}, "noise": {}},
    )


def test_every_rule_is_about_an_option():
    """A rule whose option was renamed would be silent."""
    for preset in PRESETS:
        config = make_config(
            preset, reset={"growth": {}}, randomization={"friction": [1, 1], "object": {}}
        )
        check_limits(config)
        paths = [path for path, _ in _leaves(config, "")]
        for pattern, _ in RULES:
            assert any(fnmatchcase(path, pattern) for path in paths), pattern
