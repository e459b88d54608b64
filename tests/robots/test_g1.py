"""The Unitree G1: masses, gains and frames to the manufacturer's, shells to the true ones."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omni_envs.robots import G1, KEYPOINTS, SIDES, Robot
from omni_envs.scenes import PhysicsOptions, Scene, SceneObject, build_spec, load_convex_parts

# Body: mass (kg), principal inertia (g m²); left stands for both sides.
INERTIAL = {
    "pelvis": (3.813, (10.549, 9.3089, 7.9184)),
    "left_hip_pitch_link": (1.35, (1.81517, 1.53422, 1.16212)),
    "left_hip_roll_link": (1.52, (2.54986, 2.41169, 1.48755)),
    "left_hip_yaw_link": (1.702, (7.76166, 7.17575, 1.60139)),
    "left_knee_link": (1.932, (11.3804, 11.2778, 1.46458)),
    "left_ankle_pitch_link": (0.074, (0.0189, 0.0140805, 0.0069195)),
    "left_ankle_roll_link": (0.608, (1.67218, 1.6161, 0.217621)),
    "waist_yaw_link": (0.214, (0.163531, 0.107714, 0.102205)),
    "waist_roll_link": (0.086, (0.008245, 0.007079, 0.006339)),
    "torso_link": (7.818, (121.847, 109.825, 27.3735)),
    "left_shoulder_pitch_link": (0.718, (0.465864, 0.432842, 0.406394)),
    "left_shoulder_roll_link": (0.643, (0.691311, 0.618011, 0.388977)),
    "left_shoulder_yaw_link": (0.734, (1.06187, 1.03217, 0.400661)),
    "left_elbow_link": (0.6, (0.443035, 0.421612, 0.259353)),
    "left_wrist_roll_link": (0.085445, (0.0548211, 0.0496646, 0.0357798)),
    "left_wrist_pitch_link": (0.48405, (0.430353, 0.429873, 0.164648)),
    "left_wrist_yaw_link": (0.254576, (0.646113, 0.559993, 0.147566)),
}

# Joint: range (rad) of the left side, kp, kd, effort, speed, action scale.
JOINTS = {
    "hip_pitch": ((-2.5307, 2.8798), 40.179, 2.558, 88, 32, 0.5475),
    "hip_roll": ((-0.5236, 2.9671), 99.098, 6.309, 139, 20, 0.3507),
    "hip_yaw": ((-2.7576, 2.7576), 40.179, 2.558, 88, 32, 0.5475),
    "knee": ((-0.087267, 2.8798), 99.098, 6.309, 139, 20, 0.3507),
    "ankle_pitch": ((-0.87267, 0.5236), 28.501, 1.814, 50, 37, 0.4386),
    "ankle_roll": ((-0.2618, 0.2618), 28.501, 1.814, 50, 37, 0.4386),
    "waist_yaw": ((-2.618, 2.618), 40.179, 2.558, 88, 32, 0.5475),
    "waist_roll": ((-0.52, 0.52), 28.501, 1.814, 50, 37, 0.4386),
    "waist_pitch": ((-0.52, 0.52), 28.501, 1.814, 50, 37, 0.4386),
    "shoulder_pitch": ((-3.0892, 2.6704), 14.251, 0.907, 25, 37, 0.4386),
    "shoulder_roll": ((-1.5882, 2.2515), 14.251, 0.907, 25, 37, 0.4386),
    "shoulder_yaw": ((-2.618, 2.618), 14.251, 0.907, 25, 37, 0.4386),
    "elbow": ((-1.0472, 2.0944), 14.251, 0.907, 25, 37, 0.4386),
    "wrist_roll": ((-1.97222, 1.97222), 14.251, 0.907, 25, 37, 0.4386),
    "wrist_pitch": ((-1.61443, 1.61443), 16.778, 1.068, 5, 22, 0.0745),
    "wrist_yaw": ((-1.61443, 1.61443), 16.778, 1.068, 5, 22, 0.0745),
}
LEG, WAIST, ARM = (tuple(JOINTS)[a:b] for a, b in ((0, 6), (6, 9), (9, 16)))

KINEMATICS_HULL, PHYSICS_HULL = (3, 4), (3, 5)
BUILDS = {"kinematics": None, "physics": PhysicsOptions()}


def bare(joint: str) -> str:
    """The joint's name without side and suffix."""
    return joint.removesuffix("_joint").removeprefix("left_").removeprefix("right_")


def contacts(model: mujoco.MjModel, qpos: np.ndarray) -> dict[tuple[str, str], float]:
    """Penetrating pairs of robot geoms and their depth (m)."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    found: dict[tuple[str, str], float] = {}
    for geoms, distance in zip(data.contact.geom, data.contact.dist, strict=True):
        if distance < 0 and np.all(model.geom_bodyid[geoms] > 0):
            pair = model.geom(geoms[0]).name, model.geom(geoms[1]).name
            found[pair] = max(found.get(pair, 0.0), -float(distance))
    return found


def surface(geom: int) -> np.ndarray:
    """(K, 3) points that span a geom, body frame: box corners or the ends of a capsule."""
    model = G1.model
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    if kind == int(mujoco.mjtGeom.mjGEOM_BOX):
        local, radius = signs * size, 0.0
    else:
        half = size[1] if kind == int(mujoco.mjtGeom.mjGEOM_CAPSULE) else 0.0
        local, radius = np.array([[0, 0, half], [0, 0, -half]]), size[0]
    rotation = Rotation.from_quat(model.geom_quat[geom][[1, 2, 3, 0]])
    centres = model.geom_pos[geom] + rotation.apply(local)
    return (centres[:, None] + radius * np.concatenate([np.eye(3), -np.eye(3)])).reshape(-1, 3)


def geoms(body: str, groups: tuple[int, ...]) -> list[int]:
    model = G1.model
    return [
        g
        for g in range(model.ngeom)
        if model.geom_bodyid[g] == model.body(body).id and model.geom_group[g] in groups
    ]


def test_joints_are_in_the_order_of_the_real_robot() -> None:
    expected = [
        *(f"left_{j}_joint" for j in LEG),
        *(f"right_{j}_joint" for j in LEG),
        *(f"{j}_joint" for j in WAIST),
        *(f"left_{j}_joint" for j in ARM),
        *(f"right_{j}_joint" for j in ARM),
    ]
    assert list(G1.joint_names) == expected
    assert (G1.nq, G1.nv, len(G1.body_names)) == (36, 35, 30)


def test_masses_and_inertias() -> None:
    model = G1.model
    assert model.body_subtreemass[1] == pytest.approx(33.341142, abs=1e-9)
    for name in G1.body_names:
        mass, inertia = INERTIAL[name.replace("right_", "left_")]
        body = model.body(name)
        assert body.mass[0] == pytest.approx(mass, abs=1e-12)
        # The manufacturer's right shin differs from the left in the fourth digit.
        rtol = 1e-3 if name == "right_knee_link" else 1e-6
        np.testing.assert_allclose(body.inertia, 1e-3 * np.array(inertia), rtol=rtol)


def test_gains_limits_and_armature_are_compiled() -> None:
    model = G1.model
    for i, name in enumerate(G1.joint_names):
        (low, high), kp, kd, effort, speed, scale = JOINTS[bare(name)]
        if name.startswith("right") and ("roll" in name or "yaw" in name):
            low, high = -high, -low
        np.testing.assert_allclose(model.joint(name).range, (low, high), atol=1e-12)
        assert model.actuator_trnid[i, 0] == model.joint(name).id
        assert model.actuator_gainprm[i, 0] == pytest.approx(kp, abs=5e-4)
        np.testing.assert_allclose(model.actuator_biasprm[i, :3], (0, -kp, -kd), atol=5e-4)
        assert tuple(model.actuator_forcerange[i]) == (-effort, effort)
        assert model.actuator_forcelimited[i]
        assert G1.velocity_limits[i] == speed
        assert G1.action_scale[i] == pytest.approx(scale, abs=5e-5)
        armature = model.dof_armature[6 + i]
        assert kp == pytest.approx(armature * (2 * np.pi * 10) ** 2, rel=1e-4)
        assert kd == pytest.approx(4 * armature * 2 * np.pi * 10, rel=1e-3)
        assert not model.dof_damping[6 + i] and not model.dof_frictionloss[6 + i]


def test_agrees_with_the_published_description(shared: Path) -> None:
    facts = json.loads((shared / "facts" / "robots.json").read_text())["unitree_g1_29dof"]
    model = G1.model
    assert list(G1.body_names) == [b["name"] for b in facts["bodies"]]
    assert model.body_subtreemass[1] == pytest.approx(facts["total_mass_kg"], abs=1e-9)
    unit = lambda q: np.asarray(q) / np.linalg.norm(q)  # noqa: E731
    for expected in facts["bodies"]:
        body = model.body(expected["name"])
        parent = model.body(body.parentid[0]).name
        assert parent == expected["parent"]
        np.testing.assert_allclose(body.pos, expected["pos_m"], atol=1e-12)
        np.testing.assert_allclose(body.quat, unit(expected["quat_wxyz"]), atol=1e-9)
        np.testing.assert_allclose(body.mass, expected["mass_kg"], atol=1e-12)
        np.testing.assert_allclose(body.ipos, expected["com_m"], atol=1e-12)
        np.testing.assert_allclose(body.iquat, unit(expected["inertia_quat_wxyz"]), atol=1e-9)
        np.testing.assert_allclose(body.inertia, expected["principal_inertia_kgm2"], rtol=1e-9)
        for joint in expected["joints"]:
            if joint.get("type") != "free":
                ours = model.joint(joint["name"])
                np.testing.assert_allclose(ours.range, joint["range_rad"], atol=1e-12)
                np.testing.assert_allclose(ours.axis, joint["axis"], atol=1e-12)


def test_frames_and_inertia_agree_with_pinocchio(
    check_against_pinocchio: Callable[[Robot], None],
) -> None:
    check_against_pinocchio(G1)


def test_keypoints_sit_on_the_right_links() -> None:
    data = mujoco.MjData(G1.model)
    data.qpos[:] = G1.default_qpos
    mujoco.mj_kinematics(G1.model, data)

    def world(body: str, offset: tuple[float, float, float]) -> np.ndarray:
        return data.body(body).xpos + data.body(body).xmat.reshape(3, 3) @ offset

    points = {k: world(p.body, p.offset) for k, p in G1.keypoints.items()}
    assert set(points) == set(KEYPOINTS)
    height = {k: p[2] for k, p in points.items()}
    for side, sign in (("left", 1), ("right", -1)):
        chain = ("shoulder", "elbow", "hand"), ("hip", "knee", "ankle", "toe")
        for limb in chain:
            heights = [height[f"{side}_{k}"] for k in limb]
            assert heights == sorted(heights, reverse=True)
            assert all(sign * points[f"{side}_{k}"][1] > 0.06 for k in limb)
        # The toe lies 5 mm above the sole; the ankle as high as the joint, the hand at its mount.
        assert height[f"{side}_toe"] == pytest.approx(0.005, abs=0.002)
        assert points[f"{side}_toe"][0] > points[f"{side}_ankle"][0] + 0.12
        ankle = data.body(f"{side}_ankle_pitch_link").xpos
        assert np.linalg.norm(points[f"{side}_ankle"] - ankle) == pytest.approx(0.02, abs=1e-3)
        wrist = data.body(f"{side}_wrist_yaw_link").xpos
        assert np.linalg.norm(points[f"{side}_hand"] - wrist) == pytest.approx(0.0416, abs=1e-4)
    np.testing.assert_array_equal(points["pelvis"], data.qpos[:3])


def test_left_and_right_mirror() -> None:
    """Mirrored joint states put mirrored keypoints, to the 10 µm of the manufacturer's frames."""

    def other(name: str) -> str:
        return name.replace("left", "?").replace("right", "left").replace("?", "right")

    flip = np.array([-1.0 if "roll" in j or "yaw" in j else 1.0 for j in G1.joint_names])
    swap = [G1.joint_names.index(other(j)) for j in G1.joint_names]
    data, random = mujoco.MjData(G1.model), np.random.default_rng(1)
    data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
    for _ in range(20):
        joints = random.uniform(*G1.joint_ranges.T)
        points = []
        for state in (joints, flip * joints[swap]):
            data.qpos[7:] = state
            mujoco.mj_kinematics(G1.model, data)
            points.append(
                {
                    k: data.body(p.body).xpos + data.body(p.body).xmat.reshape(3, 3) @ p.offset
                    for k, p in G1.keypoints.items()
                }
            )
        for k in KEYPOINTS:
            np.testing.assert_allclose(points[0][k] * (1, -1, 1), points[1][other(k)], atol=3e-4)


def test_only_primitives_and_looks_never_collide() -> None:
    model = G1.model
    assert model.nmesh == 0
    looks = model.geom_group == 2
    assert looks.sum() > 60
    assert not np.any(model.geom_contype[looks]) and not np.any(model.geom_conaffinity[looks])
    assert np.all(np.isin(model.geom_group[~looks], (3, 4, 5)))
    assert np.all(model.geom_contype[~looks] == 1)


@pytest.mark.parametrize("build", BUILDS)
def test_every_limb_carries_friction(build: str) -> None:
    model = build_spec(G1, Scene(), BUILDS[build], looks=False).compile()
    ground = model.geom("ground").id
    touching = set()
    for g in range(model.ngeom):
        if g != ground:
            assert model.geom_condim[g] >= 3 and model.geom_friction[g, 0] >= 0.5
            touching.add(model.body(model.geom_bodyid[g]).name)
    limbs = ("hip_yaw", "knee", "ankle_roll", "shoulder_yaw", "elbow", "wrist_yaw")
    assert touching >= {"pelvis", "torso_link", *(f"{s}_{b}_link" for s in SIDES for b in limbs)}
    # Every geom is paid for in every step: mind the count.
    assert model.ngeom < {"kinematics": 65, "physics": 45}[build]


def test_rubber_hands_resist_a_twist(check_rubber: Callable[[Robot, set[str]], None]) -> None:
    parts = {"palm_hull", "knuckle_hull", "palm_0", "palm_1", "finger_hull", "thumb_hull"}
    check_rubber(G1, parts)


def test_soles_are_flat_and_touch_the_ground() -> None:
    data = mujoco.MjData(G1.model)
    data.qpos[:] = G1.default_qpos
    mujoco.mj_kinematics(G1.model, data)
    for foot in G1.feet.values():
        sole = np.array(foot.sole)
        assert np.all(sole[:, 2] == -0.035) and sole[-1, 0] == sole[:, 0].max()
        body = data.body(foot.body)
        height = (body.xpos + sole @ body.xmat.reshape(3, 3).T)[:, 2]
        assert abs(height.min()) < 1e-4 and height.max() < 0.0015
        # Flat soles (kinematics) and sole points (physics) end in the plane of the sole; the rest
        # of the foot stays above it.
        for groups in (KINEMATICS_HULL, PHYSICS_HULL):
            lowest = {g: surface(g)[:, 2].min() for g in geoms(foot.body, groups)}
            for g, z in lowest.items():
                assert z == pytest.approx(-0.035, abs=1e-9) or (
                    G1.model.geom_group[g] == 3 and z > -0.034
                )
        corners = [np.mean(surface(g), 0)[:2] for g in geoms(foot.body, (5,))]
        assert {tuple(np.round(c, 6)) for c in corners} == {tuple(p[:2]) for p in foot.sole[:4]}
        boxes = [surface(g)[:, :2] for g in geoms(foot.body, (4,))]
        for point in sole[:, :2]:
            assert any(
                np.all(point >= b.min(0) - 1e-9) and np.all(point <= b.max(0) + 1e-9) for b in boxes
            )


@pytest.mark.parametrize("build", BUILDS)
def test_default_and_zero_pose_are_free_of_self_collision(build: str) -> None:
    model = build_spec(G1, Scene(), BUILDS[build], looks=False).compile()
    assert contacts(model, G1.default_qpos) == {}
    zero = G1.default_qpos.copy()
    zero[7:] = 0.0
    assert contacts(model, zero) == {}


@pytest.mark.parametrize("build", BUILDS)
@pytest.mark.parametrize(
    ("joints", "bodies"),
    [
        ({"left_hip_roll": -0.25, "right_hip_roll": 0.25}, ("ankle_roll", "ankle_roll")),
        ({"left_elbow": 2.0, "left_shoulder_roll": -0.2, "left_shoulder_yaw": -1.2}, ("", "torso")),
        ({"left_hip_pitch": -2.5, "waist_pitch": 0.5}, ("hip_yaw", "torso")),
    ],
)
def test_limbs_do_not_pass_through_each_other(
    build: str, joints: dict[str, float], bodies: tuple[str, str]
) -> None:
    model = build_spec(G1, Scene(), BUILDS[build], looks=False).compile()
    qpos = G1.default_qpos.copy()
    qpos[2] = 1.5
    for joint, value in joints.items():
        qpos[7 + G1.joint_names.index(f"{joint}_joint")] = value
    found = {
        tuple(sorted(model.body(model.geom(g).bodyid[0]).name for g in pair))
        for pair in contacts(model, qpos)
    }
    assert any(bodies[0] in a and bodies[1] in b for a, b in (*found, *(p[::-1] for p in found)))


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_hand_has_the_extent_of_the_rubber_hand(side: str, sign: int) -> None:
    mount = np.array(G1.keypoints[f"{side}_hand"].offset)
    names = [f"{side}_{part}_hull" for part in ("palm", "knuckle", "finger", "thumb")]
    points = np.concatenate([surface(G1.model.geom(n).id) for n in names]) - mount
    points[:, 1] *= sign
    np.testing.assert_allclose(points.min(0), (0.0, -0.048, -0.043), atol=0.006)
    np.testing.assert_allclose(points.max(0), (0.132, 0.019, 0.063), atol=0.006)


def test_stands_under_its_gains(check_stands: Callable[[Robot], None]) -> None:
    check_stands(G1)


def test_official_reference_holds_the_box_without_sinking_in(shared: Path) -> None:
    """Our shells against a motion that was solved on the true ones (their depth there: 5.8 mm)."""
    path = shared / "anchors" / "official_runs" / "sub3_largebox_003_original.npz"
    mesh = shared / "data" / "omomo" / "largebox.obj"
    if not (path.is_file() and mesh.is_file()):
        pytest.skip(f"no {path.name} or {mesh.name} in the shared data")
    qpos = np.load(path)["qpos"][::3]
    scene = Scene(object=SceneObject("largebox", load_convex_parts(mesh)))
    model = build_spec(G1, scene, looks=False).compile()
    data, segment = mujoco.MjData(model), np.zeros(6)
    robot = [g for g in range(model.ngeom) if 0 < model.geom_bodyid[g] <= len(G1.body_names)]
    target = model.geom("object_0").id
    depth, hands, own = [], [], 0.0
    for q in qpos:
        data.qpos[:], data.mocap_pos[0], data.mocap_quat[0] = q[:36], q[36:39], q[39:43]
        mujoco.mj_kinematics(model, data)
        distance = [mujoco.mj_geomDistance(model, data, g, target, 0.3, segment) for g in robot]
        depth.append(min(distance))
        bodies = [model.body(model.geom_bodyid[g]).name for g in robot]
        hands.append(
            max(
                min(d for d, b in zip(distance, bodies, strict=True) if b == f"{s}_wrist_yaw_link")
                for s in SIDES
            )
        )
        own = max([own, *contacts(model, q[:36]).values()])
    lifted = qpos[:, 38] > qpos[:, 38].min() + 0.03
    assert min(depth) > -0.008
    assert lifted.sum() > 20 and np.mean(np.array(hands)[lifted] < 0.01) > 0.95
    assert own < 0.020
