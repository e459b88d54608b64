from pathlib import Path

import numpy as np
import pytest

from omni_envs.demonstrations import SourceOptions
from omni_envs.demonstrations.source_options import MAX_FRAMES, kept_fps
from omni_envs.errors import FileFormatError, InvalidOptionError

CLIP = Path("clip")


@pytest.mark.parametrize(
    "wrong",
    [
        {"height": -1.0}, {"height": np.nan}, {"up": "up"}, {"unit": "ft"}, {"fps": 0.0},
        {"fps": np.nan}, {"fps": 1e9}, {"start": -1.0}, {"start": np.inf}, {"end": 0.0},
        {"start": 3.0, "end": 3.0}, {"height": "tall"}, {"height": True}, {"fps": "30"},
        {"start": [1.0]}, {"end": "late"}, {"up": 3}, {"up": ["z"]}, {"unit": {}},
        {"skeleton": 3}, {"body_model": ["a"]},
    ],
)  # fmt: skip
def test_values_that_make_no_sense(wrong):
    with pytest.raises(InvalidOptionError, match=f"{list(wrong)[-1]}: expected"):
        SourceOptions(**wrong)


@pytest.mark.parametrize(
    ("stated", "rate"), [(1 / 0.008333, 120.0), (29.97, 29.97), (1 / 0.0333, 1 / 0.0333), (5.0, 5)]
)
def test_rates_written_with_few_digits(stated, rate):
    assert SourceOptions().frame_rate(CLIP, "fps", stated) == rate
    assert SourceOptions(fps=60.0).frame_rate(CLIP, "fps", stated) == 60.0


@pytest.mark.parametrize("stated", [None, 0.12, 1e5, 0.0, -30.0, np.nan, np.inf])
def test_rates_that_nobody_records_at(stated):
    with pytest.raises(FileFormatError, match=r"clip: fps: expected .*option fps"):
        SourceOptions().frame_rate(CLIP, "fps", stated)
    assert SourceOptions(fps=25.0).frame_rate(CLIP, "fps", stated) == 25.0


def test_rows():
    assert SourceOptions().rows(CLIP, 100, 30.0) == slice(0, 100, 1)
    assert SourceOptions().rows(CLIP, 100, 120.0) == slice(0, 100, 4)
    assert SourceOptions(start=1.0, end=2.0).rows(CLIP, 100, 30.0) == slice(30, 60, 1)
    assert SourceOptions(start=0.5).rows(CLIP, 100, 25.0) == slice(13, 100, 1)
    assert SourceOptions(end=99.0).rows(CLIP, 100, 30.0) == slice(0, 100, 1)
    assert kept_fps(120.0) == 30.0 and kept_fps(25.0) == 25.0
    with pytest.raises(FileFormatError, match=r"within its 3.33333 s .100 frames at 30 fps"):
        SourceOptions(start=4.0).rows(CLIP, 100, 30.0)
    with pytest.raises(FileFormatError, match=f"at most {MAX_FRAMES} frames"):
        SourceOptions().rows(CLIP, MAX_FRAMES + 1, 120.0)
    assert SourceOptions(start=1.0).rows(CLIP, MAX_FRAMES + 30, 30.0).stop == MAX_FRAMES + 30
