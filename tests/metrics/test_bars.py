import io

import pytest
from rich.console import Console

from omni_envs.metrics import BARS, bars_table, evaluate
from omni_envs.robots import G1
from omni_envs.scenes import Scene

GOOD = {bar.figure: bar.limit for bar in BARS}


@pytest.mark.parametrize("bar", BARS, ids=[bar.figure for bar in BARS])
def test_a_bar_holds_up_to_its_limit(bar):
    beyond = bar.limit - 1e-9 if bar.least else bar.limit + 1e-9
    assert bar.holds(GOOD) is True
    assert bar.holds({bar.figure: beyond}) is False
    assert bar.holds({bar.figure: None}) is None and bar.holds({}) is None


def test_every_bar_is_on_a_headline_figure(standing):
    summary = evaluate(G1, Scene(), 50.0, standing(5)).summary()
    assert {bar.figure for bar in BARS} <= set(summary)


def test_the_table_marks_what_fails():
    bad = GOOD | {"stance_still_drift_max_m": 0.0123, "contact_clean_fraction": None}
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(bars_table({"good": GOOD, "bad": bad}))
    lines = console.export_text().splitlines()
    drift = next(line for line in lines if "sole centre" in line)
    assert "2 ✓" in drift and "12.3 ✗" in drift
    clean = next(line for line in lines if "clean" in line)
    assert "≥ 98" in clean and "98 ✓" in clean and "–" in clean
    assert sum("✗" in line for line in lines) == 1
