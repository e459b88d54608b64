from pathlib import Path

import pytest

from omni_envs import demo
from omni_envs.references import Reference

for package, _ in demo._NEEDS:
    pytest.importorskip(package)


def test_the_whole_story(tmp_path, monkeypatch):
    """Seconds of training: every part runs, every path that is printed exists."""
    from omni_envs.errors import RenderingError

    monkeypatch.setattr(demo, "EPISODES", 4)
    try:
        made = demo.run_demo(tmp_path / "demo", minutes=0.05, quiet=True)
    except RenderingError as error:
        pytest.skip(f"no offscreen rendering here: {error}")
    for name in ("reference", "reference_strip", "policy", "video", "policy_strip", "curve"):
        assert Path(made[name]).stat().st_size > 1000, name
    assert Reference.load(made["reference"]).robot == "g1"
    assert made["steps"] > 0 and made["parity_max_abs"] < 1e-5
    assert made["episode_length_before"] > 1 and made["penetration_max_m"] < 2e-3


def test_missing_extra_is_named_before_anything_is_made(tmp_path, monkeypatch):
    from omni_envs.errors import MissingDependencyError

    monkeypatch.setattr(demo, "_NEEDS", (("no_such_package", "export"),))
    with pytest.raises(MissingDependencyError, match=r"omni-envs\[export\]"):
        demo.run_demo(tmp_path / "demo", quiet=True)
    assert not list(tmp_path.iterdir())
