"""Body frames of the human, as orientation-matching inverse kinematics needs them.

Frames follow the SMPL convention: all parallel in the T-pose, x to the left, y up, z forward.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from omni_envs import rotations
from omni_envs.demonstrations import SMPLH, Demonstration
from omni_envs.robots import KEYPOINTS, SIDES

HUMAN_BODIES = (
    "pelvis",
    "torso",
    *(f"{s}_{b}" for s in SIDES for b in ("hip", "knee", "foot", "shoulder", "elbow", "wrist")),
)
"""Bodies in the order of every (T, 14, ·) array: a hip is the thigh, a shoulder the upper arm."""

# The joint itself where a skeleton has it: a keypoint may be something else, such as a fingertip.
_JOINTS = {
    "pelvis": ("Pelvis", "Hips"),
    "left_wrist": ("L_Wrist", "LeftHand"),
    "right_wrist": ("R_Wrist", "RightHand"),
}
_KEYPOINTS = {
    "torso": "pelvis",  # no keypoint of its own: its position is never matched
    **{f"{s}_foot": f"{s}_toe" for s in SIDES},
    **{f"{s}_wrist": f"{s}_hand" for s in SIDES},
}
_SMPLH = {
    "pelvis": "Pelvis",
    "torso": "Chest",
    **{
        f"{side}_{body}": f"{side[0].upper()}_{joint}"
        for side in SIDES
        for body, joint in (
            ("hip", "Hip"),
            ("knee", "Knee"),
            ("foot", "Toe"),
            ("shoulder", "Shoulder"),
            ("elbow", "Elbow"),
            ("wrist", "Wrist"),
        )
    },
}
# InterMimic's body frames are SMPL's with the axes permuted (wxyz).
_INTERMIMIC_TO_SMPL = np.array([0.5, 0.5, 0.5, 0.5])

# Angle below the horizontal of the ankle-to-toe line of a flat foot, rad: SMPL's shapes and
# usual mocap skeletons agree within a degree.
_FOOT_PITCH = 0.40
# Weight of the plane that stands in for the hinge plane of a straight limb, whose normal vanishes.
_KNEE_FALLBACK, _ELBOW_FALLBACK = 0.2, 0.15
# Length that the direction of the spine stands in with where pelvis and hips are one point, m.
_SPINE_FALLBACK = 0.02
_TINY = 1e-9


def human_frames(demonstration: Demonstration) -> tuple[np.ndarray, np.ndarray]:
    """Positions and orientations of ``HUMAN_BODIES``.

    Orientations are the source's own where their convention is known (InterMimic); otherwise they
    are estimated from the joint positions, see ``estimate_frames``.

    Args:
        demonstration: The human motion.

    Returns:
        (T, 14, 3) world positions, m, and (T, 14, 4) world quaternions wxyz.
    """
    names = demonstration.joint_names
    positions = demonstration.positions[:, [_joint(demonstration, b) for b in HUMAN_BODIES]]
    if demonstration.orientations is None or names != SMPLH.joint_names:
        return positions, estimate_frames(demonstration.keypoints)
    own = demonstration.orientations[:, [names.index(_SMPLH[b]) for b in HUMAN_BODIES]]
    return positions, rotations.multiply(own, _INTERMIMIC_TO_SMPL)


def _joint(demonstration: Demonstration, body: str) -> int:
    """Index of the joint where a body's frame sits."""
    keypoint = demonstration.keypoint_joints[_KEYPOINTS.get(body, body)]
    names = [n for n in _JOINTS.get(body, ()) if n in demonstration.joint_names]
    return demonstration.joint_names.index(names[0] if names else keypoint)


def estimate_frames(keypoints: np.ndarray) -> np.ndarray:
    """Estimates body frames from joint positions.

    - Pelvis: x along the line between the hips, y near the line from their middle to the pelvis
      keypoint.
    - Torso: y from the pelvis to the middle of the shoulders, x near the line between these.
    - Thigh and shin: y against the bone, x along the knee's axis, the normal of the leg's plane; a
      straight leg takes the normal of the plane of shin and foot.
    - Foot: x is the normal of the plane of shin and foot, z is the ankle-to-toe line turned up by
      the angle it has in a flat foot.
    - Upper arm, forearm and hand: x along the bone (against it on the right), y along the elbow's
      axis; a straight arm takes the axis that would bend it forward. The hand continues the
      forearm: the twist of the wrist is not observable.

    Args:
        keypoints: (T, 15, 3) world positions in the order of ``KEYPOINTS``.

    Returns:
        (T, 14, 4) world quaternions wxyz in the order of ``HUMAN_BODIES``.
    """
    point = dict(zip(KEYPOINTS, np.moveaxis(keypoints, 1, 0), strict=True))
    shoulders = 0.5 * (point["left_shoulder"] + point["right_shoulder"])
    hips = 0.5 * (point["left_hip"] + point["right_hip"])
    spine = _unit(shoulders - point["pelvis"])
    frames = {
        "pelvis": _along_x(
            point["left_hip"] - point["right_hip"],
            point["pelvis"] - hips + _SPINE_FALLBACK * spine,
        ),
        "torso": _along_y(spine, point["left_shoulder"] - point["right_shoulder"]),
    }
    left, forward = frames["torso"][..., 0], frames["torso"][..., 2]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        thigh = _unit(point[f"{side}_knee"] - point[f"{side}_hip"])
        shin = _unit(point[f"{side}_ankle"] - point[f"{side}_knee"])
        foot = _unit(point[f"{side}_toe"] - point[f"{side}_ankle"])
        sideways = np.cross(foot, shin)
        hinge = np.cross(thigh, shin) + _KNEE_FALLBACK * sideways
        frames[f"{side}_hip"] = _along_y(-thigh, hinge)
        frames[f"{side}_knee"] = _along_y(-shin, hinge)
        x = _perpendicular(sideways, foot)
        instep = np.cross(foot, x)
        sole = np.cos(_FOOT_PITCH) * foot + np.sin(_FOOT_PITCH) * instep
        frames[f"{side}_foot"] = np.stack([x, np.cross(sole, x), sole], axis=-1)

        upper = _unit(point[f"{side}_elbow"] - point[f"{side}_shoulder"])
        lower = _unit(point[f"{side}_hand"] - point[f"{side}_elbow"])
        # Forward of an arm that points forward is where a hanging arm's axis would turn it: up.
        straight = np.cross(upper, forward) - 0.2 * left
        hinge = -sign * (np.cross(upper, lower) + _ELBOW_FALLBACK * straight)
        frames[f"{side}_shoulder"] = _along_x(sign * upper, hinge)
        frames[f"{side}_elbow"] = frames[f"{side}_wrist"] = _along_x(sign * lower, hinge)
    return _quaternions(np.stack([frames[body] for body in HUMAN_BODIES], axis=1))


def _unit(v: np.ndarray) -> np.ndarray:
    """Unit vectors; x for a bone without length."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where(length > _TINY, v / np.maximum(length, _TINY), (1.0, 0.0, 0.0))


def _perpendicular(v: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """The unit vector perpendicular to a unit axis and nearest to v; any if v is parallel to it."""
    across = v - np.sum(v * axis, axis=-1, keepdims=True) * axis
    parallel = np.linalg.norm(across, axis=-1, keepdims=True) <= _TINY
    other = np.eye(3)[np.abs(axis).argmin(axis=-1)]
    return _unit(np.where(parallel, np.cross(axis, other), across))


def _along_x(x: np.ndarray, near_y: np.ndarray) -> np.ndarray:
    """(T, 3, 3) frames with the x axis given and y near a direction."""
    x = _unit(x)
    y = _perpendicular(near_y, x)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _along_y(y: np.ndarray, near_x: np.ndarray) -> np.ndarray:
    """(T, 3, 3) frames with the y axis given and x near a direction."""
    y = _unit(y)
    x = _perpendicular(near_x, y)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _quaternions(frames: np.ndarray) -> np.ndarray:
    flat = Rotation.from_matrix(frames.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    return flat.reshape(*frames.shape[:-2], 4)
