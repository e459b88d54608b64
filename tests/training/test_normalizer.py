import numpy as np
import pytest

torch = pytest.importorskip("torch")

from omni_envs.training.normalizer import STD_FLOOR, RunningNormalizer  # noqa: E402


def test_passes_through_until_fed():
    x = torch.tensor([[1.0, -2.0]])
    assert torch.allclose(RunningNormalizer(2)(x), x / (1.0 + STD_FLOOR))


def test_batches_merge_to_the_statistics_of_everything():
    rng = np.random.default_rng(0)
    data = rng.normal([3.0, -100.0, 0.0], [0.1, 20.0, 1e-4], (1000, 3)).astype(np.float32)
    normalizer = RunningNormalizer(3)
    for part in np.split(data, [10, 11, 500]):
        normalizer.update(torch.from_numpy(part))
    np.testing.assert_allclose(normalizer.mean, data.mean(0), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(normalizer.variance.sqrt(), data.std(0), rtol=1e-3)
    expected = (data - data.mean(0)) / (data.std(0) + STD_FLOOR)
    np.testing.assert_allclose(normalizer(torch.from_numpy(data)), expected, atol=2e-3)


def test_a_constant_feature_is_not_blown_up():
    normalizer = RunningNormalizer(1)
    normalizer.update(torch.full((50, 1), 7.0))
    assert abs(float(normalizer(torch.tensor([[7.1]])))) == pytest.approx(10.0, rel=1e-3)


def test_statistics_are_saved_with_the_weights():
    one, two = RunningNormalizer(2), RunningNormalizer(2)
    one.update(torch.randn(100, 2) * 3 + 1)
    two.load_state_dict(one.state_dict())
    assert torch.equal(one(torch.ones(1, 2)), two(torch.ones(1, 2)))
