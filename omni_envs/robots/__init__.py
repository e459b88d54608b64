"""What a robot is: frozen descriptions with their MJCF files.

Adding a robot takes one pair of files, here or in a package of your own:

1. ``mine.xml``, an MJCF: one free joint, then hinges; inertia in ``<inertial>`` elements; no
   actuators, no floor. Every geom is in a group: 2 looks, 3 collides, 4 flat soles and fine hulls
   (kinematics), 5 sole points and coarse hulls (physics). Hands, forearms, knees, torso and feet
   collide with ``condim="3"``. In physics use few and simple geoms, each is paid for in every step;
   ``<exclude>`` the pairs that touch at rest.
2. ``mine.py``, a ``Robot``: drives in model order, the 15 keypoints (hip, knee, ankle, shoulder and
   elbow at the joints; the toe at the tip of the sole; the hand where the wrist ends), soles,
   contact links, tracked bodies, and a default pose whose soles lie on the ground.
3. ``MINE = register_robot(Robot(...))``: from then on its name works everywhere in the process, and
   there are environments of it: ``OmniEnvs/MineTrack-v0`` and the other tasks.

For the command line and other processes, a package of your own announces the robot, and it is
imported when it is asked for. In its ``pyproject.toml``::

    [project.entry-points."omni_envs.robots"]
    mine = "my_package.mine:MINE"

Without a package, a variable does the same for modules that Python finds::

    export PYTHONPATH=. OMNI_ENVS_ROBOTS=mine=mine:MINE
    omni-envs retarget clip.bvh --robot mine --out reference.npz

``g1.py`` is the example; ``tests/robots/test_registry.py`` does the same for a toy robot.
"""

from omni_envs.robots.g1 import G1
from omni_envs.robots.h1 import H1
from omni_envs.robots.registry import adopt_robots, get_robot, register_robot, robot_names
from omni_envs.robots.robot import (
    CONTACT_LINKS,
    KEYPOINTS,
    SIDES,
    Actuator,
    BodyPoint,
    Foot,
    Robot,
)
from omni_envs.robots.t1 import T1

__all__ = [
    "CONTACT_LINKS",
    "G1",
    "H1",
    "KEYPOINTS",
    "SIDES",
    "T1",
    "Actuator",
    "BodyPoint",
    "Foot",
    "Robot",
    "adopt_robots",
    "get_robot",
    "register_robot",
    "robot_names",
]
