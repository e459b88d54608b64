import mujoco
import numpy as np
import pytest
import trimesh

from omni_envs.errors import InvalidDataError
from omni_envs.metrics.playback import TARGETS, play
from omni_envs.robots import G1, KEYPOINTS
from omni_envs.robots.self_collision import resting_pairs
from omni_envs.scenes import Box, ConvexMesh, Part, Scene, SceneObject, Terrain, build_spec

BOX = SceneObject("box", (Part(Box((0.2, 0.2, 0.2))),))


def random_poses(count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    qpos = np.tile(G1.default_qpos, (count, 1))
    low, high = G1.joint_ranges.T
    qpos[:, 7:] = low + rng.random((count, len(low))) * (high - low)
    turn = rng.normal(size=(count, 4))
    qpos[:, 3:7] = turn / np.linalg.norm(turn, axis=1, keepdims=True)
    qpos[:, 2] = 0.1
    return qpos


def brute_force(qpos: np.ndarray, pose: np.ndarray, thing: SceneObject = BOX) -> dict[str, float]:
    """Depth by the distance of every single pair of geoms."""
    spec = build_spec(G1, Scene(object=thing), looks=False)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    data.mocap_pos[0], data.mocap_quat[0] = pose[:3], pose[3:]
    mujoco.mj_kinematics(model, data)
    excluded = {frozenset(pair) for pair in resting_pairs(G1)}
    for e in spec.excludes:
        excluded.add(frozenset((e.bodyname1, e.bodyname2)))
    depth = {"object": 0.0, "ground": 0.0, "self": 0.0}
    for a in range(model.ngeom):
        for b in range(a + 1, model.ngeom):
            bodies = [model.body(int(model.geom_bodyid[g])).name for g in (a, b)]
            outside = [n for n in bodies if n in ("world", "object")]
            if len(outside) == 2 or bodies[0] == bodies[1]:
                continue
            parents = [model.body(int(model.body(n).parentid[0])).name for n in bodies]
            if not outside and (bodies[0] == parents[1] or bodies[1] == parents[0]):
                continue
            if frozenset(bodies) in excluded:
                continue
            kind = {"world": "ground", "object": "object"}[outside[0]] if outside else "self"
            distance = mujoco.mj_geomDistance(model, data, a, b, 0.01, None)
            depth[kind] = max(depth[kind], -distance)
    return depth


def deepest(playback, target):
    pairs = playback.target == target
    return max(0.0, -playback.distance[pairs].min(initial=0.0))


@pytest.mark.parametrize("seed", range(6))
def test_depths_agree_with_the_distance_of_every_pair(seed):
    qpos = random_poses(1, seed)
    pose = np.array([0.2, 0.1, 0.1, 0.8, 0.6, 0.0, 0.0])
    playback = play(G1, Scene(object=BOX), 50.0, qpos, pose[None])
    expected = brute_force(qpos[0], pose)
    assert expected["object"] > 0 and expected["ground"] > 0
    for name, target in (("object", 0), ("ground", TARGETS.index("ground")), ("self", -1)):
        assert deepest(playback, target) == pytest.approx(expected[name], abs=1e-3), name


def test_depths_in_a_scanned_box_are_exact():
    """On faces that are not quite flat several contacts of a pair may be millimetres off."""
    mesh = trimesh.creation.box(extents=(0.5, 0.4, 0.3)).subdivide().subdivide().subdivide()
    noise = np.random.default_rng(0).normal(scale=5e-4, size=mesh.vertices.shape)
    hull = trimesh.Trimesh(mesh.vertices + noise).convex_hull
    scan = SceneObject("scan", (Part(ConvexMesh(hull.vertices, hull.faces)),))
    pose = np.array([0.2, 0.1, 0.1, 0.8, 0.6, 0.0, 0.0])
    for seed in range(12):
        qpos = random_poses(1, seed)
        playback = play(G1, Scene(object=scan), 50.0, qpos, pose[None])
        expected = brute_force(qpos[0], pose, scan)["object"]
        assert deepest(playback, 0) == pytest.approx(expected, abs=1e-4)


def test_normals_point_from_the_target_to_the_robot(standing):
    scene = Scene(terrain=Terrain((Part(Box((1, 1, 0.1)), (0.0, 0.0, -0.05)),)))
    playback = play(G1, scene, 50.0, standing(), None)
    for name in ("terrain", "ground"):
        pairs = playback.target == TARGETS.index(name)
        feet = pairs & playback.bodies(("left_ankle_roll_link",))
        assert feet.any()
        np.testing.assert_allclose(playback.normal[feet], [[0, 0, 1]] * feet.sum(), atol=1e-6)


def test_keypoints_and_soles_are_those_of_the_model():
    qpos = random_poses(3)
    playback = play(G1, Scene(), 50.0, qpos, None)
    data = mujoco.MjData(G1.model)
    for t in range(3):
        data.qpos[:] = qpos[t]
        mujoco.mj_kinematics(G1.model, data)
        for k, name in enumerate(KEYPOINTS):
            point = G1.keypoints[name]
            body = data.body(point.body)
            expected = body.xpos + body.xmat.reshape(3, 3) @ point.offset
            np.testing.assert_allclose(playback.keypoints()[t, k], expected, atol=1e-12)
        body = data.body("right_ankle_roll_link")
        for i, offset in enumerate(G1.feet["right"].sole):
            expected = body.xpos + body.xmat.reshape(3, 3) @ offset
            np.testing.assert_allclose(playback.soles()[t, 1, i], expected, atol=1e-12)


def test_bad_motions_are_refused(standing):
    pose = np.array([[1.0, 0, 0, 1, 0, 0, 0]])
    scene = Scene(object=BOX)
    with pytest.raises(InvalidDataError, match="object_poses"):
        play(G1, scene, 50.0, standing(), None)
    with pytest.raises(InvalidDataError, match="object_poses"):
        play(G1, Scene(), 50.0, standing(), pose)
    with pytest.raises(InvalidDataError, match="object_poses"):
        play(G1, scene, 50.0, standing(2), pose)
    with pytest.raises(InvalidDataError, match="qpos"):
        play(G1, Scene(), 50.0, np.zeros((3, 30)), None)
    with pytest.raises(InvalidDataError, match="finite"):
        play(G1, Scene(), 50.0, np.full((3, G1.nq), np.nan), None)
    with pytest.raises(InvalidDataError, match="fps"):
        play(G1, Scene(), 0.0, standing(), None)
