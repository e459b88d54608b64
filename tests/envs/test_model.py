import mujoco
import numpy as np
import pytest

from omni_envs.envs.model import build_model
from omni_envs.robots import G1
from omni_envs.tracking.config import make_config


def compiled(reference, **options):
    return build_model(G1, reference.scene, make_config(**options))


def test_object_comes_last_and_nothing_is_only_for_show(reference):
    model = compiled(reference).model
    assert (model.nq, model.nv, model.nu) == (43, 41, 29)
    assert int(model.jnt_qposadr[model.joint("object").id]) == 36
    assert not (np.asarray(model.geom_group) == 2).any()
    assert int(model.opt.jacobian) == int(mujoco.mjtJacobian.mjJAC_SPARSE)


def test_feet_stand_on_four_spheres(reference):
    model = compiled(reference).model
    for side in ("left", "right"):
        foot = model.body(f"{side}_ankle_roll_link").id
        kinds = [int(model.geom_type[g]) for g in np.flatnonzero(model.geom_bodyid == foot)]
        assert kinds.count(int(mujoco.mjtGeom.mjGEOM_SPHERE)) == 4
        assert int(mujoco.mjtGeom.mjGEOM_BOX) not in kinds


def test_everything_that_supports_has_friction(reference):
    model = compiled(reference).model
    for g in range(model.ngeom):
        assert int(model.geom_condim[g]) >= 3, model.geom(g).name


def test_physics_options_reach_the_model(reference):
    model = compiled(reference, physics="fast").model
    assert model.opt.timestep == pytest.approx(0.01)
    assert int(model.opt.integrator) == int(mujoco.mjtIntegrator.mjINT_DISCRETE)


def test_contact_rules_watch_different_bodies(reference):
    own = compiled(reference)
    assert {"torso_link", "left_ankle_roll_link"} <= set(own.contact_bodies)
    assert own.samples == 4
    any_contact = compiled(reference, reward={"contact_rule": "any"})
    assert "torso_link" in any_contact.contact_bodies
    assert "left_knee_link" in any_contact.contact_bodies
    for body in ("left_ankle_roll_link", "right_wrist_yaw_link"):
        assert body not in any_contact.contact_bodies
    assert any_contact.samples == 3  # BeyondMimic looks back three physics steps
    substeps = compiled(reference, reward={"contact_rule": "substeps"})
    assert substeps.contact_bodies == ()
    assert substeps.model.nsensor == 1


def test_friction_randomization_decides_against_the_ground(reference):
    model = compiled(reference, preset="beyondmimic").model
    robot = [
        g for g in range(model.ngeom) if model.body(int(model.geom_bodyid[g])).name in G1.body_names
    ]
    assert (np.asarray(model.geom_priority)[robot] == 1).all()
    assert int(model.geom_priority[model.geom("ground").id]) == 0
