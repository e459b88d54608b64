import json
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

import omni_envs  # noqa: F401  (registers the environments)
from omni_envs.envs import OmniEnv
from omni_envs.envs.spec import plain
from omni_envs.robots import G1


def test_options_become_what_json_has():
    options = {
        "reference": [Path("a") / "b.npz", "c.npz"],
        "autoreset_mode": AutoresetMode.SAME_STEP,
        "robot": G1,
        "num_envs": np.int64(3),
        "randomization": {"push": {"interval": np.array([1.0, 3.0])}},
        "reset": {"noise": None},
        "action": {"limit": np.float32(0.5)},
        "width": 640,
    }
    assert json.loads(json.dumps(plain(options))) == {
        "reference": [str(Path("a") / "b.npz"), "c.npz"],
        "autoreset_mode": "SAME_STEP",
        "robot": "g1",
        "num_envs": 3,
        "randomization": {"push": {"interval": [1.0, 3.0]}},
        "reset": {"noise": None},
        "action": {"limit": 0.5},
        "width": 640,
    }
    assert isinstance(options["reference"][0], Path)


def test_what_json_has_no_word_for_stays(sway):
    reference = sway(10)
    assert plain({"reference": reference})["reference"] is reference
    env = gym.make("OmniEnvs/G1BoxCarry-v0", reference=reference)
    assert env.unwrapped.spec.kwargs["reference"] is reference
    again = gym.make(env.spec)
    np.testing.assert_array_equal(again.reset(seed=2)[0], env.reset(seed=2)[0])


def test_an_environment_without_a_spec_has_none(sway):
    env = OmniEnv(reference=sway(10))
    assert env.spec is None
    env.spec = None
    assert env.spec is None
