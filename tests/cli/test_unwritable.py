"""A place that cannot be written is one line, whatever the command."""

import errno
from pathlib import Path

import pytest

from omni_envs import files
from omni_envs.cli import main
from omni_envs.references import build

LIBRARY = Path(__file__).parents[2] / "references/box_carry/g1/nominal.npz"
RECIPE = "robots: [g1]\nsources: [{demonstration: box_carry}]\n"


@pytest.fixture
def words(tmp_path):
    """Commands that write into a folder that is a file."""
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text(RECIPE)
    (tmp_path / "file").write_text("no folder")
    inside = str(tmp_path / "file" / "out.npz")
    return {
        "retarget": ["retarget", "box_carry", "--out", inside],
        "several": ["retarget", "box_carry", "crawl", "--out", inside],
        "generate": ["generate", str(recipe), "--out", inside],
        "in place of a file": ["generate", str(recipe), "--out", str(tmp_path / "file")],
    }


@pytest.mark.parametrize("case", ["retarget", "several", "generate", "in place of a file"])
def test_no_folder(words, capsys, monkeypatch, case):
    def never(*_, **__):
        raise AssertionError("the place is tried before the work begins")

    monkeypatch.setattr(build, "retarget", never)
    assert main(words[case]) == 1
    message = capsys.readouterr().err.strip().splitlines()[-1]
    assert message.startswith("omni-envs: ") and "file" in message
    assert "File exists" in message or "Not a directory" in message


def test_a_full_disk(tmp_path, capsys, monkeypatch):
    def full(fd):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full)
    out = tmp_path / "new" / "out.npz"
    words = ["convert", str(LIBRARY), "--to", "mjlab", "--out", str(out)]
    assert main(words) == 1
    assert capsys.readouterr().err.strip() == f"omni-envs: {out}: No space left on device"
    assert not list(out.parent.iterdir())  # no half of a file
