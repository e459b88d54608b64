from dataclasses import dataclass
from typing import Literal

import pytest

from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.tracking.options import override


@dataclass(frozen=True)
class Inner:
    size: float = 1.0


@dataclass(frozen=True)
class Outer:
    inner: Inner | None = None
    other: Inner = Inner(3.0)
    count: int = 2
    pair: tuple[float, float] = (0.0, 1.0)
    names: tuple[str, ...] = ()
    mode: Literal["a", "b"] = "a"
    on: bool = True


def test_mappings_change_only_what_they_name():
    changed = override(Outer(), {"other": {"size": 4}, "pair": [2, 3], "names": ["x"]}, "thing")
    assert changed == Outer(other=Inner(4.0), pair=(2.0, 3.0), names=("x",))
    assert override(changed, None, "thing") is changed


def test_an_instance_is_taken_as_it_is():
    assert override(Outer(), Outer(count=7), "thing") == Outer(count=7)


def test_absent_parts_can_be_switched_on_and_off():
    on = override(Outer(), {"inner": {"size": 2}}, "thing")
    assert on.inner == Inner(2.0)
    assert override(on, {"inner": None}, "thing").inner is None


def test_an_unknown_field_lists_the_valid_ones():
    with pytest.raises(UnknownNameError, match=r"thing option 'cuont'.*'count'.*Valid: count, inn"):
        override(Outer(), {"cuont": 1}, "thing")
    with pytest.raises(UnknownNameError, match=r"thing.other option 'sise'.*Valid: size"):
        override(Outer(), {"other": {"sise": 1}}, "thing")


@pytest.mark.parametrize(
    "changes",
    [
        {"count": 1.5},
        {"count": True},
        {"count": "2"},
        {"other": 3},
        {"other": {"size": "big"}},
        {"other": {"size": float("nan")}},
        {"other": None},
        {"pair": [1]},
        {"pair": 1},
        {"names": "abc"},
        {"on": 1},
        5,
    ],
)
def test_wrong_values_are_refused(changes):
    with pytest.raises(InvalidOptionError, match="thing"):
        override(Outer(), changes, "thing")


def test_a_wrong_choice_lists_the_choices():
    with pytest.raises(UnknownNameError, match="Valid: a, b"):
        override(Outer(), {"mode": "c"}, "thing")
