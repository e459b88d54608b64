import json

import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")

from omni_envs.envs import OmniVectorEnv
from omni_envs.errors import InvalidOptionError
from omni_envs.export.description import describe, need_torso_alone
from omni_envs.robots import G1


def test_sidecar_is_json_with_the_whole_layout(described):
    description = described(anchor=None, observation={})
    data = json.loads(json.dumps(description.sidecar(), allow_nan=False))
    terms = data["observation"]["terms"]
    assert sum(t["size"] for t in terms) == data["observation"]["size"] == 160
    assert data["action"]["scale"] == G1.action_scale.tolist()
    assert data["anchor_body"] == "pelvis"
    assert data["reference"]["frames"] == 12 and data["control_step_s"] == 0.02


def test_several_motions_do_not_fit_into_one_file(motion):
    env = OmniVectorEnv(1, num_threads=1, reference=[motion, motion])
    with pytest.raises(InvalidOptionError, match="holds one motion; the environment has 2"):
        describe(env)


def test_stacks_that_compare_the_torso_need_policies_that_do(described):
    need_torso_alone(described(), "stack")
    for options, message in (
        ({"observation": {}}, "160 numbers, with estimated position and velocity"),
        ({"anchor": "pelvis"}, "the pelvis compared with the motion, not torso_link"),
    ):
        with pytest.raises(InvalidOptionError, match=f"Profile 'stack': .*{message}"):
            need_torso_alone(described(**options), "stack")
