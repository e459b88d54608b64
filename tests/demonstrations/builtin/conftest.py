import pytest

from omni_envs.demonstrations import scale_demonstration


@pytest.fixture(scope="module")
def joint(demo):
    """Name to (T, 3) positions of the demonstration that the module calls ``demo``."""
    return {name: demo.positions[:, i] for i, name in enumerate(demo.joint_names)}


@pytest.fixture(scope="module")
def source(demo):
    """The same for a robot of the G1's height."""
    return scale_demonstration(demo, 1.32)
