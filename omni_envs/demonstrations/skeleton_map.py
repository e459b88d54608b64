"""Which joint of a recording plays which keypoint: known, or told by the user in a YAML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from omni_envs.demonstrations.skeleton import Skeleton
from omni_envs.demonstrations.yaml_file import read_yaml
from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.robots import CONTACT_LINKS, KEYPOINTS, SIDES

_FIELDS = ("name", "keypoints", "head_top", "contacts", "joint_names")


@dataclass(frozen=True)
class SkeletonMap:
    """A table from keypoints to joint names, to be fitted to the joints of a file.

    Attributes:
        name: What it is called.
        keypoints: For every name in ``KEYPOINTS`` the joint that plays it.
        head_top: Joint at the top of the head, where there is one: it gives the height.
        contacts: Link of ``CONTACT_LINKS`` to the joints whose distance decides contact. A link
            without an entry takes its keypoint; hands also take every joint below the wrist.
        joint_names: Order of the joints, for arrays that carry no names.
    """

    name: str
    keypoints: Mapping[str, str]
    head_top: str | None = None
    contacts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    joint_names: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        owner = f"Skeleton map {self.name!r}"
        for what, keys, valid in (
            ("keypoints", self.keypoints, KEYPOINTS),
            ("contacts", self.contacts, CONTACT_LINKS),
        ):
            if unknown := [key for key in keys if key not in valid]:
                raise InvalidDataError(owner, what, f"keys among {', '.join(valid)}", str(unknown))
        if missing := [key for key in KEYPOINTS if key not in self.keypoints]:
            expected = f"a joint for each of {', '.join(KEYPOINTS)}"
            raise InvalidDataError(owner, "keypoints", expected, f"none for {', '.join(missing)}")
        joints = list(self.keypoints.values())
        if twice := sorted({joint for joint in joints if joints.count(joint) > 1}):
            expected = "15 different joints"
            raise InvalidDataError(owner, "keypoints", expected, f"{', '.join(twice)} twice")
        names = self.joint_names or ()
        if len(set(names)) < len(names):
            raise InvalidDataError(owner, "joint_names", "names that differ", "duplicates")

    @property
    def joints(self) -> tuple[str, ...]:
        """Every joint that the map speaks of."""
        top = () if self.head_top is None else (self.head_top,)
        return (*self.keypoints.values(), *top, *sum(self.contacts.values(), ()))

    def fit(
        self, path: str | Path, joint_names: Sequence[str], parents: Sequence[int] | None = None
    ) -> Skeleton:
        """Makes a skeleton of the joints of a file.

        Args:
            path: The file, for error messages.
            joint_names: Its J joints.
            parents: (J,) index of every joint's parent, −1 for the root, where that is known.

        Raises:
            FileFormatError: The file lacks a joint that the map names.
        """
        missing = [joint for joint in self.joints if joint not in joint_names]
        if missing:
            expected = f"those of the skeleton {self.name!r}"
            found = f"no {', '.join(missing)} among {', '.join(joint_names)}"
            raise FileFormatError(path, "joints", expected, found)
        contacts = dict(self.contacts)
        for side in SIDES:
            hand = self.keypoints[f"{side}_hand"]
            contacts.setdefault(f"{side}_hand", (hand, *joints_below(hand, joint_names, parents)))
            contacts.setdefault(f"{side}_foot", (self.keypoints[f"{side}_toe"],))
            contacts.setdefault(f"{side}_knee", (self.keypoints[f"{side}_knee"],))
        return Skeleton(self.name, tuple(joint_names), self.keypoints, contacts)

    def to_yaml(self) -> str:
        """The map as text that ``read_skeleton_map`` reads."""
        table: dict[str, Any] = {"name": self.name, "keypoints": dict(self.keypoints)}
        if self.head_top is not None:
            table["head_top"] = self.head_top
        if self.contacts:
            table["contacts"] = {link: list(joints) for link, joints in self.contacts.items()}
        if self.joint_names is not None:
            table["joint_names"] = list(self.joint_names)
        return yaml.safe_dump(table, sort_keys=False, allow_unicode=True)


def read_skeleton_map(path: str | Path) -> SkeletonMap:
    """Reads a skeleton map.

    .. code-block:: yaml

        name: my suit
        keypoints: {pelvis: Hips, left_hip: LeftThigh, left_knee: LeftShin, …}  # all 15
        head_top: HeadTip                    # optional
        contacts: {left_hand: [LeftHand]}    # optional
        joint_names: [Hips, LeftThigh, …]    # only for arrays that carry no names

    Args:
        path: YAML file.

    Raises:
        FileFormatError: The file is missing, is no YAML, or is not such a table.
    """
    path = Path(path)
    table = read_yaml(path)
    if not isinstance(table, dict) or not all(key in _FIELDS for key in table):
        found = ", ".join(map(str, table))[:120] if isinstance(table, dict) else str(table)[:60]
        raise FileFormatError(path, "content", f"a table with {', '.join(_FIELDS)}", repr(found))
    contacts = _table(path, "contacts", table.get("contacts", {}))
    head_top = table.get("head_top")
    names = table.get("joint_names")
    for what, value in (("name", table.get("name", path.stem)), ("head_top", head_top or "")):
        if not isinstance(value, str):
            raise FileFormatError(path, what, "text", repr(value)[:60])
    keypoints = _table(path, "keypoints", table.get("keypoints"))
    for key, joint in keypoints.items():
        if not isinstance(joint, str):
            raise FileFormatError(path, f"keypoints: {key}", "a joint's name", repr(joint)[:60])
    try:
        return SkeletonMap(
            name=table.get("name", path.stem),
            keypoints=keypoints,
            head_top=head_top or None,
            contacts={link: _names(path, f"contacts: {link}", j) for link, j in contacts.items()},
            joint_names=None if names is None else _names(path, "joint_names", names),
        )
    except InvalidDataError as error:
        raise FileFormatError(path, error.field, "a valid skeleton map", str(error)) from error


def joints_below(
    joint: str, joint_names: Sequence[str], parents: Sequence[int] | None
) -> tuple[str, ...]:
    """Joints that hang on a joint, parents before their children; none where parents are unknown.

    Args:
        joint: Name of the joint.
        joint_names: All J joints, parents first.
        parents: (J,) index of every joint's parent, −1 for the root.
    """
    if parents is None:
        return ()
    inside = {list(joint_names).index(joint)}
    below = []
    for i, parent in enumerate(parents):  # parents come first
        if parent in inside:
            inside.add(i)
            below.append(joint_names[i])
    return tuple(below)


def _table(path: Path, what: str, value: object) -> dict[str, Any]:
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        raise FileFormatError(path, what, "a table of names", repr(value)[:60])
    return value


def _names(path: Path, what: str, value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise FileFormatError(path, what, "a list of names", repr(value)[:60])
    return tuple(value)
