"""What the pages say is what the package does."""

import re
from pathlib import Path

import pytest

from omni_envs.demonstrations.namings import NAMINGS
from omni_envs.demonstrations.omomo import CONVERSION

SOURCES = Path(__file__).parents[1] / "docs/sources.md"


@pytest.mark.parametrize("naming", NAMINGS, ids=lambda naming: naming.name)
def test_every_naming_is_in_the_table(naming):
    (row,) = (
        line for line in SOURCES.read_text().splitlines() if line.startswith(f"| `{naming.name}`")
    )
    keypoints = naming.keypoints()
    assert f"| {keypoints['pelvis']} |" in row
    if "as `accad`" not in row:
        for part in ("hip", "knee", "ankle", "shoulder", "elbow", "hand"):
            assert keypoints[f"left_{part}"] in row
    elif naming.name != "accad":
        accad = next(n for n in NAMINGS if n.name == "accad")
        assert naming.keypoints() == accad.keypoints()


def test_the_conversion_of_omomo_is_the_one_that_errors_name():
    assert CONVERSION in SOURCES.read_text()


NUMBERS = Path(__file__).parents[1] / "docs/paper_numbers.md"


def test_every_test_that_pins_a_number_exists():
    named = re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", NUMBERS.read_text())
    assert len(named) > 25
    root = NUMBERS.parents[1]
    for file, test in named:
        assert f"def {test}" in (root / file).read_text(), f"{file}::{test}"
