"""A proposal of a skeleton map for joints that follow no known naming.

Names are compared with the words that people use for a part of the body; a limb is a chain of
joints, each below the one before, whose names together fit best. Sides come from the names (``l``,
``left``, …), or, where they tell none, from where the toes point. The standard library's
``difflib`` is enough: a skeleton has a hundred joints, and the words are few. A proposal is never
used before the user has seen it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from functools import lru_cache
from itertools import combinations, product

import numpy as np

from omni_envs.demonstrations.namings import short_names
from omni_envs.demonstrations.recording import Recording
from omni_envs.demonstrations.skeleton_map import SkeletonMap
from omni_envs.errors import FileFormatError

_WORDS = {
    "pelvis": ("hips", "pelvis", "hip", "root"),
    "hip": ("upleg", "thigh", "upperleg", "hip", "legupper", "femur"),
    "knee": ("leg", "shin", "lowerleg", "calf", "knee", "lowleg", "leglower", "tibia"),
    "ankle": ("foot", "ankle"),
    "toe": ("toe", "toebase", "toes", "ball", "footend", "foottip"),
    "shoulder": ("arm", "upperarm", "uparm", "shoulder", "shldr", "armupper", "humerus"),
    "elbow": ("forearm", "lowerarm", "lowarm", "elbow", "armlower", "radius"),
    "hand": ("hand", "wrist"),
}
_LEG, _ARM = ("hip", "knee", "ankle", "toe"), ("shoulder", "elbow", "hand")
_SIDES = {"l": "left", "left": "left", "lft": "left", "r": "right", "right": "right"}
_TOKEN = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_TIPS = ("end", "top", "tip", "nub")
_SKIPPED = 0.05  # points off for every joint that a chain leaps over
_SHORT = 0.05  # of the longest bone; a bone that is shorter is no limb
_HOPELESS, _WEAK = 0.4, 0.6  # scores below which a joint is out, or doubtful
_LIKELY = 8  # joints that are tried for a part where there is no tree


@dataclass(frozen=True)
class Guess:
    """A proposed map.

    Attributes:
        skeleton: The map.
        scores: Keypoint to how well its joint's name fits, 0 to 1.
        unused: Joints that play nothing.
    """

    skeleton: SkeletonMap
    scores: dict[str, float]
    unused: tuple[str, ...]

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Keypoints whose joint's name hardly fits: look at these."""
        return tuple(keypoint for keypoint, score in self.scores.items() if score < _WEAK)


@dataclass(frozen=True)
class _Chain:
    joints: tuple[int, ...]
    scores: tuple[float, ...]
    total: float


def guess_skeleton(recording: Recording) -> Guess:
    """Proposes a map.

    Args:
        recording: Names and positions of the joints, and their tree where the file has one. Without
            it the shorter of two chains wins.

    Raises:
        FileFormatError: The joints have no names, or nothing like two legs and two arms is found.
    """
    names, path = recording.joint_names, recording.path
    if not names:
        raise FileFormatError(path, "joints", "names to go by", "an array without names")
    tokens = [_tokens(name) for name in short_names(names)]
    sides = [next((_SIDES[t] for t in words if t in _SIDES), None) for words in tokens]
    stems = ["".join(t for t in words if t not in _SIDES and not t.isdigit()) for words in tokens]
    places = recording.positions[0] if recording.rest is None else recording.rest
    parents = recording.parents
    table: dict[str, int] = {}
    scores: dict[str, float] = {}
    pairs: dict[tuple[str, ...], tuple[_Chain, _Chain]] = {}
    limbs: tuple[tuple[str, ...], ...] = (_LEG, _ARM)
    for limb in limbs:
        pair = _pair(limb, parents, stems, sides, places)
        if pair is None:
            found = ", ".join(names)[:200]
            raise FileFormatError(path, "joints", f"two limbs of {', '.join(limb)}", found)
        pairs[limb] = pair
    if _told(pairs[_LEG], sides) and _told(pairs[_ARM], sides):
        swapped = dict.fromkeys(pairs, False)
    else:
        swapped = _by_geometry(pairs[_LEG], pairs[_ARM], recording)
    for limb, pair in pairs.items():
        ordered = pair[::-1] if swapped[limb] else pair
        for side, chain in zip(("left", "right"), ordered, strict=True):
            for part, joint, score in zip(limb, chain.joints, chain.scores, strict=True):
                table[f"{side}_{part}"], scores[f"{side}_{part}"] = joint, score
    if parents is None:
        free = [i for i in range(len(names)) if i not in table.values() and sides[i] is None]
        if not free:
            raise FileFormatError(path, "joints", "a pelvis", ", ".join(names)[:200])
        table["pelvis"] = max(free, key=lambda i: _fit(stems[i], "pelvis"))
    else:
        table["pelvis"] = _common(table["left_hip"], table["right_hip"], parents)
    scores["pelvis"] = _fit(stems[table["pelvis"]], "pelvis")
    top = [i for i, words in enumerate(tokens) if "head" in words and {*words} & {*_TIPS}]
    top = top or [i for i, stem in enumerate(stems) if stem in {f"head{tip}" for tip in _TIPS}]
    skeleton = SkeletonMap(
        f"{path.stem} (proposed)",
        {k: names[table[k]] for k in ("pelvis", *(k for k in table if k != "pelvis"))},
        head_top=names[top[0]] if top else None,
    )
    unused = tuple(name for name in names if name not in skeleton.joints)
    return Guess(skeleton, {k: scores[k] for k in skeleton.keypoints}, unused)


def _tokens(name: str) -> list[str]:
    words = [token.lower() for token in _TOKEN.findall(name)]
    split: list[str] = []
    for word in words:  # leftarm, armright
        match = re.fullmatch(r"(left|right)(.+)|(.+)(left|right)", word)
        split += [part for part in match.groups() if part] if match else [word]
    return split


@lru_cache(maxsize=4096)
def _fit(stem: str, part: str) -> float:
    return max(SequenceMatcher(None, stem, word).ratio() for word in _WORDS[part])


def _pair(
    limb: Sequence[str],
    parents: Sequence[int] | None,
    stems: Sequence[str],
    sides: Sequence[str | None],
    places: np.ndarray,
) -> tuple[_Chain, _Chain] | None:
    """The best chain of either side, or the two best that share no joint."""
    chains = _chains(limb, parents, stems, sides, places)
    left, right = (
        max((c for c in chains if _side(c, sides) == side), key=lambda c: c.total, default=None)
        for side in ("left", "right")
    )
    if left is not None and right is not None:
        return left, right
    first = max(chains, key=lambda c: c.total, default=None)
    if first is None:
        return None
    apart = [c for c in chains if not {*c.joints} & {*first.joints}]
    second = max(apart, key=lambda c: c.total, default=None)
    return None if second is None else (first, second)


def _chains(
    limb: Sequence[str],
    parents: Sequence[int] | None,
    stems: Sequence[str],
    sides: Sequence[str | None],
    places: np.ndarray,
) -> list[_Chain]:
    found = []
    bones = [(i, p) for i, p in enumerate(parents or ()) if p >= 0]
    longest = max((float(np.linalg.norm(places[i] - places[p])) for i, p in bones), default=0.0)
    for joints, cost in _lines(limb, parents, stems, places):
        told = {sides[j] for j in joints} - {None}
        lengths = np.linalg.norm(np.diff(places[list(joints)], axis=0), axis=1)
        if len(told) > 1 or not (lengths > _SHORT * longest).all():
            continue
        scores = tuple(_fit(stems[j], part) for j, part in zip(joints, limb, strict=True))
        found.append(_Chain(joints, scores, sum(scores) - cost))
    return found


def _lines(
    limb: Sequence[str],
    parents: Sequence[int] | None,
    stems: Sequence[str],
    places: np.ndarray,
) -> Iterator[tuple[tuple[int, ...], float]]:
    """Chains of joints that may be a limb, with the points that each costs for its leaps."""
    if parents is not None:
        for tip, stem in enumerate(stems):
            if _fit(stem, limb[-1]) < _HOPELESS:
                continue
            line = _line(tip, parents)[1:]
            for above in combinations(range(len(line)), len(limb) - 1):
                joints = (*(line[i] for i in reversed(above)), tip)
                yield joints, _SKIPPED * (above[-1] + 2 - len(limb))
        return
    likely = [
        sorted((i for i, stem in enumerate(stems) if _fit(stem, part) >= _HOPELESS),
               key=lambda i: -_fit(stems[i], part))[:_LIKELY]
        for part in limb
    ]  # fmt: skip
    size = float(np.ptp(places, axis=0).max()) or 1.0
    for joints in product(*likely):
        if len({*joints}) == len(joints):
            reach = np.linalg.norm(np.diff(places[list(joints)], axis=0), axis=1).sum()
            yield joints, float(reach) / size


def _line(joint: int, parents: Sequence[int]) -> list[int]:
    """A joint and its ancestors, upwards, no more than a limb can need."""
    line = [joint]
    while parents[line[-1]] >= 0 and len(line) < 10:
        line.append(parents[line[-1]])
    return line


def _side(chain: _Chain, sides: Sequence[str | None]) -> str | None:
    return next((sides[j] for j in chain.joints if sides[j] is not None), None)


def _told(pair: tuple[_Chain, _Chain], sides: Sequence[str | None]) -> bool:
    return [_side(chain, sides) for chain in pair] == ["left", "right"]


def _by_geometry(
    legs: tuple[_Chain, _Chain], arms: tuple[_Chain, _Chain], recording: Recording
) -> dict[tuple[str, ...], bool]:
    """Whether the first limb of each pair is the right one: left is up × where the toes point."""
    at = recording.positions

    def middle(pair: tuple[_Chain, _Chain], part: int) -> np.ndarray:
        return 0.5 * (at[:, pair[0].joints[part]] + at[:, pair[1].joints[part]])

    up = middle(arms, 0) - middle(legs, 0)
    left = np.cross(up, middle(legs, 3) - middle(legs, 2))
    swapped: dict[tuple[str, ...], bool] = {}
    for limb, pair in ((_LEG, legs), (_ARM, arms)):
        across = at[:, pair[0].joints[0]] - at[:, pair[1].joints[0]]
        swapped[limb] = bool(np.mean(np.sum(across * left, axis=1)) < 0)
    return swapped


def _common(a: int, b: int, parents: Sequence[int]) -> int:
    """The lowest common ancestor of two joints."""
    above = _ancestors(a, parents)
    return next(joint for joint in _ancestors(b, parents) if joint in above)


def _ancestors(joint: int, parents: Sequence[int]) -> list[int]:
    line = [parents[joint]]
    while line[-1] >= 0 and parents[line[-1]] >= 0:
        line.append(parents[line[-1]])
    return line
