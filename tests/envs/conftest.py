import pytest

from omni_envs.envs import OmniVectorEnv


@pytest.fixture(scope="session")
def reference(sway):
    return sway()


@pytest.fixture(scope="session")
def reference_file(reference, tmp_path_factory):
    return str(reference.save(tmp_path_factory.mktemp("references") / "sway.npz"))


QUIET = {
    "observation": {"noise": None},
    "reset": {"noise": None},
    "randomization": {
        "torso_centre_of_mass": None,
        "joint_default": 0.0,
        "push": None,
        "object": None,
    },
}
"""Options without any chance but the start frames."""


@pytest.fixture(scope="session")
def quiet():
    return QUIET


@pytest.fixture
def make(reference):
    """Makes a vector environment on the swaying reference."""
    made = []

    def factory(num_envs=4, **options):
        options = {"reference": reference, "num_threads": 1, **options}
        made.append(OmniVectorEnv(num_envs, **options))
        return made[-1]

    yield factory
    for env in made:
        env.close()
