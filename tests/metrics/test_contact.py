import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.metrics.contact import contact_gaps, contact_surfaces, link_distance
from omni_envs.metrics.playback import TARGETS, play
from omni_envs.robots import G1
from omni_envs.scenes import Box, Part, Scene, SceneObject, Terrain

BOX = SceneObject("box", (Part(Box((0.15, 0.15, 0.15))),))
TERRAIN = Terrain((Part(Box((1.0, 1.0, 0.1))),))


def box_beside_the_hand(qpos, gap):
    """(1, 7) pose of the box whose face x = -0.15 is ``gap`` in front of the left hand."""
    target = TARGETS.index("object")
    low, high = 0.2, 1.5
    for _ in range(16):
        pose = np.array([[0.5 * (low + high), 0.25, 0.8, 1, 0, 0, 0]])
        playback = play(G1, Scene(object=BOX), 50.0, qpos, pose)
        pairs = (playback.target == target) & playback.bodies(G1.contact_links["left_hand"])
        distance = playback.distance[pairs].min(initial=np.inf)
        low, high = (low, pose[0, 0]) if distance > gap else (pose[0, 0], high)
    return pose


@pytest.mark.parametrize("gap", [-0.02, 0.005, 0.03])
def test_distance_of_a_link_is_signed(standing, gap):
    pose = box_beside_the_hand(standing(), gap)
    playback = play(G1, Scene(object=BOX), 50.0, standing(), pose)
    assert link_distance(playback, "left_hand", ("object",))[0] == pytest.approx(gap, abs=1e-4)
    assert link_distance(playback, "left_hand", ("terrain",))[0] == np.inf
    assert link_distance(playback, "right_knee", ("object",))[0] == np.inf


def test_what_contact_is_with():
    assert contact_surfaces(Scene(object=BOX, terrain=TERRAIN), "left_hand") == ("object",)
    assert contact_surfaces(Scene(object=BOX), "left_foot") == ("object",)
    assert contact_surfaces(Scene(terrain=TERRAIN), "left_foot") == ("terrain",)
    assert contact_surfaces(Scene(terrain=TERRAIN), "left_hand") == ("terrain", "ground")
    assert contact_surfaces(Scene(), "left_knee") == ("terrain", "ground")


def test_gap_is_the_distance_from_the_touched_point_to_the_link(standing):
    qpos = standing(4)
    playback = play(G1, Scene(), 50.0, qpos, None)
    foot = playback.soles()[0, 0, :4].mean(axis=0)
    points = foot + np.array([[0, 0, 0.005], [0, 0, -0.03], [0, 0.5, 0], [0, 0, 0]])
    points[3] = np.nan
    gap = contact_gaps(playback, {"left_foot": points}, None)["left_foot"]
    assert gap[0] == 0.0  # inside
    assert gap[1] == pytest.approx(0.03, abs=2e-4)
    assert 0.4 < gap[2] < 0.5
    assert np.isnan(gap[3])


def test_gap_belongs_to_the_object(standing):
    qpos = standing(2)
    turn = rotations.exp(np.array([0.3, 0.2, 1.0]))
    poses = np.array([[0.4, 0.1, 0.9, 1, 0, 0, 0], [0.0, 0.0, 0.0, *turn]])
    point = np.array([0.01, 0.02, 0.03])
    # The same point of the object, and the robot moved along with the object.
    qpos[1, :3] = rotations.rotate(turn, qpos[0, :3] - poses[0, :3])
    qpos[1, 3:7] = rotations.multiply(turn, qpos[0, 3:7])
    playback = play(G1, Scene(object=BOX), 50.0, qpos, poses)
    gaps = contact_gaps(playback, {"left_hand": np.tile(point, (2, 1))}, poses)["left_hand"]
    assert gaps[0] > 0.05
    assert gaps[1] == pytest.approx(gaps[0], abs=1e-9)
