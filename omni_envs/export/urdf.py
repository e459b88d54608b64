"""A robot's links, hinges and masses as URDF: what stacks compute kinematics from."""

from __future__ import annotations

import warnings
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from omni_envs.robots import Robot


def robot_urdf(robot: Robot) -> str:
    """Returns the URDF of a robot, without shapes: every body a link, every hinge a joint.

    Poses, axes, ranges, efforts, speeds and inertias are those of the robot's model.
    """
    model = robot.model
    root = ElementTree.Element("robot", name=robot.name)
    for body in range(1, model.nbody):
        name = model.body(body).name
        link = ElementTree.SubElement(root, "link", name=name)
        inertial = ElementTree.SubElement(link, "inertial")
        _origin(inertial, model.body_ipos[body], model.body_iquat[body])
        ElementTree.SubElement(inertial, "mass", value=_text(model.body_mass[body]))
        inertia = ElementTree.SubElement(inertial, "inertia", ixy="0", ixz="0", iyz="0")
        for key, moment in zip(("ixx", "iyy", "izz"), model.body_inertia[body], strict=True):
            inertia.set(key, _text(moment))
        if name == robot.root_body:
            continue
        hinges = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
        joint = _joint(root, robot, name, list(hinges))
        ElementTree.SubElement(joint, "parent", link=model.body(model.body_parentid[body]).name)
        ElementTree.SubElement(joint, "child", link=name)
        _origin(joint, model.body_pos[body], model.body_quat[body])
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode")


def _joint(
    root: ElementTree.Element, robot: Robot, body: str, hinges: list[int]
) -> ElementTree.Element:
    model = robot.model
    if not hinges:
        return ElementTree.SubElement(root, "joint", name=f"{body}_fixed", type="fixed")
    (hinge,) = hinges
    if np.any(model.jnt_pos[hinge]):
        raise ValueError(f"Hinge of {body} is not at the body's origin.")
    joint = ElementTree.SubElement(root, "joint", name=model.joint(hinge).name, type="revolute")
    ElementTree.SubElement(joint, "axis", xyz=_text(*model.jnt_axis[hinge]))
    place = robot.joint_names.index(model.joint(hinge).name)
    low, high = model.jnt_range[hinge]
    ElementTree.SubElement(
        joint,
        "limit",
        lower=_text(low),
        upper=_text(high),
        effort=_text(robot.actuators[place].effort),
        velocity=_text(robot.velocity_limits[place]),
    )
    return joint


def _origin(parent: ElementTree.Element, position: np.ndarray, quaternion: np.ndarray) -> None:
    with warnings.catch_warnings():
        # At a pitch of 90° any of the angles that scipy may choose from is the same rotation.
        warnings.filterwarnings("ignore", message="Gimbal lock")
        angles = Rotation.from_quat(quaternion, scalar_first=True).as_euler("xyz")
    ElementTree.SubElement(parent, "origin", xyz=_text(*position), rpy=_text(*angles))


def _text(*values: float) -> str:
    return " ".join(repr(float(v)) for v in values)
