"""The published numbers; every one of them is an option."""

from dataclasses import asdict
from math import pi

import pytest

from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.tracking.config import OPTIONS, PRESETS, RewardConfig, TrackingTerm, make_config

PAPER, BEYONDMIMIC = PRESETS["paper"], PRESETS["beyondmimic"]


@pytest.mark.parametrize(
    ("term", "weight", "sigma"),
    [
        ("anchor_position", 0.5, 0.3),
        ("anchor_orientation", 0.5, 0.4),
        ("body_position", 1.0, 0.3),
        ("body_orientation", 1.0, 0.4),
        ("body_linear_velocity", 1.0, 1.0),
        ("body_angular_velocity", 1.0, 3.14),
        ("object_position", 1.0, 0.3),
        ("object_orientation", 1.0, 0.4),
    ],
)
def test_tracking_terms(term, weight, sigma):
    assert getattr(PAPER.reward, term) == TrackingTerm(weight, sigma)
    if not term.startswith("object"):
        assert getattr(BEYONDMIMIC.reward, term) == TrackingTerm(weight, sigma)


@pytest.mark.parametrize("preset", PRESETS.values(), ids=PRESETS)
def test_penalties(preset):
    reward = preset.reward
    assert (reward.action_rate, reward.joint_limit, reward.contact) == (-0.1, -10.0, -0.1)
    assert (reward.soft_limit, reward.contact_force) == (0.9, 1.0)


@pytest.mark.parametrize("preset", PRESETS.values(), ids=PRESETS)
def test_body_terminations(preset):
    t = preset.termination
    assert (t.anchor_height, t.anchor_tilt, t.end_effector_height) == (0.25, 0.8, 0.25)
    assert t.max_seconds == 10.0


def test_object_termination_of_the_paper():
    assert PAPER.termination.object_position == 1.0
    assert PAPER.termination.object_angle == pytest.approx(pi / 4)
    assert PAPER.termination.object_after > 0


@pytest.mark.parametrize("preset", PRESETS.values(), ids=PRESETS)
def test_observation_noise(preset):
    noise = preset.observation.noise
    assert noise.anchor_position == (0.0 if preset is PAPER else 0.25)
    assert noise.anchor_orientation == 0.05
    assert noise.base_linear_velocity == 0.5
    assert noise.base_angular_velocity == 0.2
    assert noise.joint_position == 0.01
    assert noise.joint_velocity == 0.5


@pytest.mark.parametrize("preset", PRESETS.values(), ids=PRESETS)
def test_reset_noise(preset):
    noise = preset.reset.noise
    assert noise.root_position == (0.05, 0.05, 0.01)
    assert noise.root_orientation == (0.1, 0.1, 0.2)
    assert noise.root_linear_velocity == (0.5, 0.5, 0.2)
    assert noise.root_angular_velocity == (0.52, 0.52, 0.78)
    assert noise.joint_position == 0.1
    assert noise.object_position == (0.05, 0.05, 0.0)


def test_randomization_of_the_paper():
    r = PAPER.randomization
    assert r.torso_centre_of_mass == (0.025, 0.05, 0.075)
    assert r.joint_default == 0.01
    assert r.friction is None
    assert r.push.interval == (1.0, 3.0)
    assert r.push.linear == (0.3,) * 3
    assert r.push.angular == (0.78,) * 3
    assert r.object.mass == (0.1, 2.0)
    assert r.object.centre_of_mass == 0.08
    assert r.object.inertia == (0.5, 1.5)
    assert r.object.shape == 0.1


def test_the_presets_differ_exactly_where_the_sources_do():
    def flat(data, prefix=""):
        rows = {}
        for key, value in data.items():
            if isinstance(value, dict):
                rows |= flat(value, f"{prefix}{key}.")
            else:
                rows[f"{prefix}{key}"] = value
        return rows

    a, b = flat(asdict(PAPER)), flat(asdict(BEYONDMIMIC))
    differing = {k for k in a.keys() | b.keys() if a.get(k, "absent") != b.get(k, "absent")}
    groups = {k.rsplit(".", 1)[0] if "object." in k else k for k in differing}
    assert groups == {
        "anchor",
        "randomization.torso_centre_of_mass",
        "randomization.push.linear",
        "randomization.push.angular",
        "randomization.friction",
        "randomization.object",
        "observation.noise.anchor_position",
        "reward.contact_rule",
        "reward.object_position",
        "reward.object_orientation",
        "reward.object_position.weight",
        "reward.object_position.sigma",
        "reward.object_orientation.weight",
        "reward.object_orientation.sigma",
        "termination.object_position",
        "termination.object_angle",
        "reset.start",
    }


def test_values_of_beyondmimic():
    c = BEYONDMIMIC
    assert c.anchor == "torso"
    assert c.randomization.torso_centre_of_mass == (0.025, 0.05, 0.05)
    assert c.randomization.push.linear == (0.5, 0.5, 0.2)
    assert c.randomization.push.angular == (0.52, 0.52, 0.78)
    assert c.randomization.friction == (0.3, 1.2)
    assert c.observation.noise.anchor_position == 0.25
    assert c.reward.contact_rule == "any"
    adaptive = c.reset.adaptive
    assert c.reset.start == "adaptive"
    assert (adaptive.uniform, adaptive.decay, adaptive.kernel) == (0.1, 0.999, 1)
    assert adaptive.kernel_decay == 0.8


def test_control_step_is_a_fiftieth_of_a_second():
    for physics in ("default", "fast"):
        assert make_config(physics=physics).physics.control_step == pytest.approx(0.02)
    assert PAPER.physics.timestep == 0.005
    assert PAPER.physics.substeps == 4


def test_wall_flip_is_two_options():
    c = make_config(
        termination={"end_effector_height": 0.5},
        reward={"no_orientation": ["left_ankle_roll_link", "right_ankle_roll_link"]},
    )
    assert c.termination.end_effector_height == 0.5
    assert len(c.reward.no_orientation) == 2


def test_a_group_may_be_a_dataclass():
    reward = RewardConfig(action_rate=-0.3)
    assert make_config(reward=reward).reward is reward


def test_bad_options():
    with pytest.raises(UnknownNameError, match=r"preset 'papre'.*Valid: beyondmimic, paper"):
        make_config("papre")
    with pytest.raises(UnknownNameError, match="Valid: " + ", ".join(sorted(OPTIONS))):
        make_config(rewards={})
    with pytest.raises(UnknownNameError, match="physics preset 'quick'"):
        make_config(physics="quick")
    with pytest.raises(InvalidOptionError, match="fewer than 5"):
        make_config(physics={"iterations": 3})
