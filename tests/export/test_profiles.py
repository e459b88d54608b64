"""The same policy in every profile: what the stack feeds and what it does with the actions."""

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
import torch

from omni_envs.errors import InvalidOptionError
from omni_envs.export.parity import parity
from omni_envs.export.profiles import WRITERS
from omni_envs.export.run import PROFILES

MODES = ("default", "residual", "feedforward")


def test_every_profile_has_a_writer():
    assert tuple(WRITERS) == PROFILES


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("mode", MODES)
def test_every_profile_asks_for_the_joint_targets_of_the_network(
    described, export, observed, profile, mode
):
    description = described(mode)
    graph, file, _ = export(profile, description)
    frames = np.array([0, 3, 7, 11])
    seen = observed(frames, description)
    with torch.no_grad():
        action = graph.actor(torch.from_numpy(seen)).numpy()
    default = description.robot.default_joint_array
    offset = default if mode == "default" else description.targets[frames]
    target = default + description.action_scale * file(seen, frames)
    np.testing.assert_allclose(target, offset + description.action_scale * action, atol=1e-5)
    assert parity(graph, file, seen) <= 1e-5


def test_all_profiles_give_the_same_actions(described, export, observed, tmp_path):
    description, frames = described("feedforward"), np.arange(12)
    seen = observed(frames, description)
    actions = [export(p, description, tmp_path / p)[1](seen, frames) for p in PROFILES]
    for other in actions[1:]:
        np.testing.assert_allclose(other, actions[0], atol=1e-5)
    assert np.abs(actions[0]).max() > 0.1


@pytest.mark.parametrize("profile", ["beyondmimic", "holosoma"])
@pytest.mark.parametrize("late", [0, 1])
def test_the_lead_is_of_the_frame_that_is_observed(described, export, observed, profile, late):
    """Stacks that observe the last run's outputs are a frame late at every time step but the first.

    So are motion_tracking_controller and holosoma_inference.
    """
    description = described("feedforward")
    graph, file, _ = export(profile, description)
    for time_step in range(15):
        shown = min(max(time_step - late, 0), 11)
        seen = observed([shown], description)
        with torch.no_grad():
            action = graph.actor(torch.from_numpy(seen)).numpy()
        expected = description.targets[shown] + description.action_scale * action
        default = description.robot.default_joint_array
        found = default + description.action_scale * file(seen, np.array([time_step]))
        np.testing.assert_allclose(found, expected, atol=1e-5)


@pytest.mark.parametrize("profile", ["holosoma", "unitree"])
def test_what_a_stack_would_feed_otherwise_is_refused(described, actor, profile):
    for options in ({"observation": {}}, {"anchor": "pelvis"}):
        description = described(**options)
        with pytest.raises(InvalidOptionError, match=f"Profile '{profile}': the policy was traine"):
            WRITERS[profile].graph(actor(description.layout.size), description)
