import numpy as np
import pytest

from omni_envs.envs.divergence import Divergence, replay
from omni_envs.errors import FileFormatError, InvalidDataError


@pytest.mark.parametrize("scenes", ["boxes", "two"])
def test_a_control_step_is_played_again_to_the_bit(make, sway, scenes, tmp_path):
    # Randomized fields, or, with several scenes, randomized models.
    references = [sway(), sway(half=0.2)] if scenes == "two" else sway()
    env = make(6, reference=references)
    env.reset(seed=0)
    for action in np.random.default_rng(0).normal(size=(10, 6, 29)):
        env.step(action)
    env.advance(np.full((6, 29), 3.0))
    for i in (1, 5):
        divergence = Divergence(i, 0, 0, **env.simulation.before(i))
        found = replay(env.simulation, Divergence.load(divergence.save(tmp_path / "d.npz")))
        np.testing.assert_array_equal(found.qpos[0], divergence.qpos)
        np.testing.assert_array_equal(found.qpos[-1], env.simulation.qpos[i])
        np.testing.assert_array_equal(found.qvel[-1], env.simulation.qvel[i])
        assert found.qpos.shape == (5, 43) and not found.warnings.any()


def test_an_explosion_is_played_again(make, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # MuJoCo logs the warning into the working directory
    env = make(3)
    env.reset(seed=0)
    env.simulation.qvel[1] = 1e12
    env.step(np.zeros((3, 29)))
    (divergence,) = env.divergences
    found = replay(env.simulation, divergence)
    assert found.warnings[0] == 0 and found.warnings[-1] > 0


def test_files_and_models_that_do_not_fit_are_refused(make, tmp_path):
    env = make(1)
    env.reset(seed=0)
    divergence = Divergence(0, 0, 0, **env.simulation.before(0))
    object.__setattr__(divergence, "qpos", divergence.qpos[:36])
    with pytest.raises(InvalidDataError, match="qpos"):
        replay(env.simulation, divergence)
    with pytest.raises(FileFormatError, match="qacc_warmstart"):
        Divergence.load(tmp_path / "nothing.npz")
    np.savez(tmp_path / "other.npz", qpos=np.zeros(3))
    with pytest.raises(FileFormatError, match="qacc_warmstart"):
        Divergence.load(tmp_path / "other.npz")
