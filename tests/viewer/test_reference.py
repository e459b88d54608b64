import pytest

from omni_envs.errors import InvalidOptionError
from omni_envs.references import Reference, reference_from_qpos
from omni_envs.robots import G1
from omni_envs.viewer import reference as module
from omni_envs.viewer import reference_strip, reference_video


@pytest.fixture
def reference() -> Reference:
    return reference_from_qpos(G1, 50.0, G1.default_qpos[None].repeat(10, axis=0))


def test_a_place_that_cannot_be_is_told_before_the_pictures_are_drawn(
    reference, tmp_path, monkeypatch
):
    def never(*_, **__):
        raise AssertionError("drawn in vain")

    monkeypatch.setattr(module, "reference_frames", never)
    with pytest.raises(InvalidOptionError, match=r"\.png, \.jpg"):
        reference_strip(reference, tmp_path / "a.bmp")
    with pytest.raises(InvalidOptionError, match=r"\.mp4, \.gif"):
        reference_video(reference, tmp_path / "a.avi")
    (tmp_path / "file").touch()
    for write, name in ((reference_strip, "a.png"), (reference_video, "a.mp4")):
        with pytest.raises(OSError, match="file"):
            write(reference, tmp_path / "file" / name)
