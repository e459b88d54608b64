"""The interaction mesh of body and surroundings, and its deformation energy.

The energy of target keypoints p is E(p) = Σ_i ‖L(p_i^target) - L(p_i^source)‖², with uniform
Laplacian coordinates L(p_i) = p_i - mean of the neighbours (Ho, Komura, Tai 2010; OmniRetarget eq.
1-3), in the frame of the object. Only the rows that touch a keypoint vary with the robot. With L =
[L_k, L_o] split into the 15 keypoints and the surface points:

    E(p) = tr(PᵀMP) + 2 tr(cᵀP) + e₀,   M = L_kᵀL_k,   c = L_kᵀ(L_o P_o - δ),   δ = L P_source,

exactly, a 15 × 15 problem instead of one with 115 vertices. As the rows of L sum to zero, P may be
the world offsets from the object's origin once c is rotated into the world.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, QhullError

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting import kernels
from omni_envs.retargeting.surface_points import SurfacePoints, surface_points
from omni_envs.robots import KEYPOINTS

_K = len(KEYPOINTS)
_RIDGE = 1e-9
_EDGES = np.array([(i, j) for i in range(4) for j in range(4) if i != j])


def rotation_matrices(quaternions: np.ndarray) -> np.ndarray:
    """(..., 3, 3) rotation matrices of (..., 4) unit quaternions wxyz."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@dataclass(frozen=True, eq=False)
class Connectivity:
    """Who is whose neighbour in every source frame. Independent of target and robot motion.

    Attributes:
        points: (T, V, 3) source points that were connected.
        bits: (T, V, ⌈V/8⌉) adjacency matrices, packed.
    """

    points: np.ndarray
    bits: np.ndarray

    def adjacency(self, frame: int) -> np.ndarray:
        """(V, V) bool, who is whose neighbour on one frame."""
        return np.unpackbits(self.bits[frame], axis=-1, count=self.points.shape[1]).astype(bool)


def connect(points: np.ndarray) -> Connectivity:
    """Connects (T, V, 3) points by one Delaunay mesh per frame."""
    frames, vertices = points.shape[:2]
    bits = np.empty((frames, vertices, (vertices + 7) // 8), np.uint8)
    adjacency = np.zeros((vertices, vertices), bool)
    for t in range(frames):
        adjacency[:] = False
        simplices = _delaunay(points[t])
        adjacency[simplices[:, _EDGES[:, 0]], simplices[:, _EDGES[:, 1]]] = True
        bits[t] = np.packbits(adjacency, axis=-1)
    return Connectivity(points, bits)


def _delaunay(points: np.ndarray) -> np.ndarray:
    try:
        return Delaunay(points).simplices
    except QhullError:
        # Flat or coincident points: joggle them, deterministically.
        return Delaunay(points, qhull_options="QJ Qbb").simplices


_connectivities: list[Connectivity] = []


def _connectivity(points: np.ndarray) -> Connectivity:
    """The connectivity of (T, V, 3) points: a recent one where the points are the same.

    To the bit: points on a circle are connected one way or the other by the last digit, and what a
    process made before must not decide it.
    """
    for known in _connectivities:
        if np.array_equal(known.points, points):
            return known
    _connectivities.insert(0, connect(points))
    del _connectivities[8:]
    return _connectivities[0]


@dataclass(frozen=True, eq=False)
class InteractionMesh:
    """The deformation energy of every frame, reduced to the keypoints.

    With r = ``factor`` @ p + ``offset`` for (15, 3) world keypoints p, E = ‖r‖² + ``constant``.

    Attributes:
        factor: (T, 15, 15) upper triangular U with UᵀU = M.
        offset: (T, 15, 3).
        constant: (T,) m².
    """

    factor: np.ndarray
    offset: np.ndarray
    constant: np.ndarray

    @classmethod
    def build(
        cls,
        keypoints: np.ndarray,
        points: SurfacePoints,
        source_poses: np.ndarray | None = None,
        target_poses: np.ndarray | None = None,
    ) -> InteractionMesh:
        """Connects a source and reduces its energy about a target.

        Args:
            keypoints: (T, 15, 3) source keypoints, world.
            points: Surface points of source and target.
            source_poses: (T, 7) frame of the source points; None is the world.
            target_poses: (T, 7) frame of the target points; None is the world.
        """
        frames = len(keypoints)
        local = keypoints
        if source_poses is not None:
            rotation = rotation_matrices(source_poses[:, 3:])
            local = (keypoints - source_poses[:, None, :3]) @ rotation
        surface = np.broadcast_to(points.source, (frames, *points.source.shape[-2:]))
        vertices = np.concatenate([local, surface], axis=1)
        connectivity = _connectivity(vertices)
        target = points.target.reshape(-1, *points.target.shape[-2:])
        moment, linear, rest = kernels.reduced_energies(connectivity.bits, vertices, target, _K)
        factor = np.swapaxes(np.linalg.cholesky(moment + _RIDGE * np.eye(_K)), 1, 2)
        if target_poses is not None:
            linear = linear @ np.swapaxes(rotation_matrices(target_poses[:, 3:]), 1, 2)
        offset = np.linalg.solve(np.swapaxes(factor, 1, 2), linear)
        constant = rest - np.einsum("tkd,tkd->t", offset, offset)
        if target_poses is not None:
            offset = offset - factor.sum(axis=2, keepdims=True) * target_poses[:, None, :3]
        return cls(factor, offset, constant)

    @classmethod
    def of(cls, source: SourceMotion, count: int = 100, ground: int = 0) -> InteractionMesh:
        """The mesh of a source motion: see ``surface_points``."""
        poses = source.object_poses
        return cls.build(
            source.keypoints,
            surface_points(source, count, ground),
            source.source_object_poses,
            poses if source.mesh_object_poses is None else source.mesh_object_poses,
        )

    def energy(self, keypoints: np.ndarray) -> np.ndarray:
        """(T,) deformation energy of (T, 15, 3) robot keypoints, m²."""
        residual = self.factor @ keypoints + self.offset
        return np.einsum("tkd,tkd->t", residual, residual) + self.constant
