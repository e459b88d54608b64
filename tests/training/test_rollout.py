import numpy as np

from omni_envs.training.rollout import play


def _still(observations, frames):
    return np.zeros((len(observations), 2), np.float32)


def test_every_simulation_plays_exactly_one_episode(chase):
    calls = []

    def first_one_runs_away(observations, frames):
        calls.append(frames.copy())
        actions = _still(observations, frames)
        actions[0] = 2.0
        return actions

    env = chase(4)
    done = []
    episodes = play(env, first_one_runs_away, seed=0, progress=lambda *n: done.append(n))
    assert episodes.terminated.tolist() == [True, False, False, False]
    assert episodes.lengths[0] < 10 and episodes.lengths[1:].tolist() == [20, 20, 20]
    assert len(calls) == 20 and done[-1] == (4, 4)
    # the frames that the policy gets are those of the observation, restarts included
    np.testing.assert_array_equal([c[1] for c in calls], np.arange(20))
    assert calls[episodes.lengths[0]][0] == 0


def test_return_and_error_are_those_of_the_episode(chase):
    env = chase(3)
    env.reset(seed=5)
    start = np.linalg.norm(env.position, axis=1)
    episodes = play(env, _still, seed=5)
    np.testing.assert_allclose(episodes.body_error, start)
    np.testing.assert_allclose(episodes.returns, 20 * np.exp(-10 * start**2))


def test_the_largest_distance_of_the_object_is_kept(chase):
    class WithObject(chase):
        def step(self, actions):
            *rest, infos = super().step(actions)
            infos["error/object_position"] = np.where(self.time == 5, 0.4, 0.1)
            return *rest, infos

    assert play(chase(3), _still, seed=0).object_error is None
    assert play(WithObject(3), _still, seed=0).object_error.tolist() == [0.4] * 3


def test_a_window_ends_alive(chase):
    episodes = play(chase(3), _still, seed=0, max_steps=7)
    assert episodes.lengths.tolist() == [7, 7, 7] and not episodes.terminated.any()
