"""A page in the browser on which a reference can be looked at from all sides, frame by frame."""

from __future__ import annotations

import io
import socket
import time
from contextlib import redirect_stdout
from dataclasses import replace
from typing import Any

import numpy as np

from omni_envs.errors import InvalidOptionError, MissingDependencyError, OmniEnvsError
from omni_envs.references import Reference
from omni_envs.robots import SIDES, get_robot
from omni_envs.scenes.rendering import camera_pose
from omni_envs.viewer.layers import BONES, Marks, contact_marks, mesh_edges, violations
from omni_envs.viewer.meshes import robot_meshes
from omni_envs.viewer.viewpoint import choose_camera

SPEEDS = ("0.1×", "0.25×", "0.5×", "1×", "2×")
_HUMAN, _MESH, _ALARM = (217, 77, 64), (90, 120, 220), (0.85, 0.1, 0.1)
_OBJECT, _TERRAIN = (196, 154, 108), (150, 158, 168)
_MARK_RADIUS = 0.045
_PORTS = 100  # tried in turn
_HIDDEN = np.array([0.0, 0.0, -100.0])


class ReferencePage:
    """Serves a reference as a page: robot, human keypoints, object, terrain, mesh, marks, timeline.

    Args:
        reference: What to show.
        host: Address to listen on.
        port: Port; the next free one is taken where it is in use.

    Raises:
        MissingDependencyError: viser is not installed.
        InvalidOptionError: There is no such port.
        OmniEnvsError: The address cannot be listened on.
    """

    def __init__(self, reference: Reference, *, host: str = "127.0.0.1", port: int = 8080) -> None:
        if not 0 <= port < 65536:
            raise InvalidOptionError(f"port: expected 0 (any) to 65535; got {port}.")
        try:
            import viser
        except ImportError as error:
            raise MissingDependencyError("viser", "viewer", "The page of a reference") from error
        self.reference = reference
        self._deep = violations(reference)
        self._robot = get_robot(reference.robot)
        self._camera = replace(choose_camera(reference), distance=2.1 * self._robot.height)
        port = _free_port(host, port)
        with redirect_stdout(io.StringIO()):  # its banner; we print the address ourselves
            self.server = viser.ViserServer(host, port, label=_title(reference), verbose=False)
        self.url = f"http://{host}:{self.server.get_port()}"
        self._clock, self._seen = 0.0, 0
        self._build_scene()
        self._build_controls()
        self.server.on_client_connect(self._look)
        self.show(0)

    @property
    def frame(self) -> int:
        """The frame that is shown."""
        return int(self._slider.value)

    @property
    def playing(self) -> bool:
        """Whether time goes on."""
        return self._playing

    def show(self, frame: int) -> None:
        """Shows a frame."""
        if frame != self._slider.value:
            self._slider.value = frame  # its callback draws
        else:
            self._draw(frame)

    def advance(self, seconds: float) -> None:
        """Lets so much of the viewer's time pass, if it plays; starts over at the end."""
        if not self._playing:
            return
        rate = float(self._speed.value.rstrip("×")) * self.reference.fps
        self._clock = (self._clock + seconds * rate) % self.reference.num_frames
        if int(self._clock) != self.frame:
            self.show(int(self._clock))

    def run(self, rate: float = 50.0) -> None:
        """Serves until interrupted."""
        last = time.monotonic()
        while True:
            time.sleep(max(0.0, last + 1.0 / rate - time.monotonic()))
            now = time.monotonic()
            self.advance(now - last)
            last = now

    def close(self) -> None:
        """Stops serving."""
        self.server.stop()

    def _build_scene(self) -> None:
        scene, reference = self.server.scene, self.reference
        scene.set_up_direction("+z")
        scene.add_grid("/ground", 20.0, 20.0, cell_size=0.25, plane_opacity=1.0, shadow_opacity=0.3)
        self._bodies = {}
        for body, meshes in robot_meshes(self._robot).items():
            self._bodies[body] = scene.add_frame(f"/robot/{body}", show_axes=False)
            for i, (colour, mesh) in enumerate(meshes):
                self._add_mesh(f"/robot/{body}/{i}", mesh, np.array(colour[:3]) * 255)
        surroundings = reference.scene
        self._object = None
        if surroundings.object is not None:
            self._object = scene.add_frame("/object", show_axes=False)
            self._add_mesh("/object/surface", surroundings.object.surface(), np.array(_OBJECT))
        if surroundings.terrain is not None:
            self._add_mesh("/terrain", surroundings.terrain.surface(), np.array(_TERRAIN))
        source = reference.source
        self._human = self._bones = self._edges = None
        if source is not None:
            points = source.keypoints[0]
            self._human = scene.add_point_cloud(
                "/human/keypoints", points, _HUMAN, point_size=0.03, point_shape="circle",
                precision="float32",
            )  # fmt: skip
            self._bones = scene.add_line_segments(
                "/human/bones", points[BONES], _HUMAN, thickness=0.012
            )
            self._edges = scene.add_line_segments(
                "/mesh", mesh_edges(source, 0), _MESH, thickness=0.003, visible=False
            )
        links = max(1, len(reference.contacts))
        self._touch = [
            scene.add_icosphere(f"/contacts/{i}", _MARK_RADIUS, opacity=0.6) for i in range(links)
        ]
        self._alarm = [
            scene.add_icosphere(f"/violations/{i}", _MARK_RADIUS, tuple(255 * c for c in _ALARM))
            for i in range(max(1, *map(len, self._deep)))
        ]

    def _add_mesh(self, name: str, mesh: Any, colour: np.ndarray) -> None:
        self.server.scene.add_mesh_simple(
            name, np.asarray(mesh.vertices), np.asarray(mesh.faces), color=tuple(map(int, colour)),
            flat_shading=len(mesh.faces) < 100,
        )  # fmt: skip

    def _build_controls(self) -> None:
        gui = self.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        gui.add_markdown(f"**{_title(self.reference)}**")
        last = max(1, self.reference.num_frames - 1)
        self._slider = gui.add_slider("Frame", 0, last, 1, 0)
        self._button = gui.add_button("Play")
        self._speed = gui.add_dropdown("Speed", SPEEDS, initial_value="1×")
        self._following = gui.add_checkbox("Follow", True)
        self._figures = gui.add_markdown("")
        self._playing = False

        @self._slider.on_update
        def _(_: object) -> None:
            if abs(self._clock - self.frame) >= 1.0:
                self._clock = float(self.frame)
            self._draw(self.frame)

        @self._button.on_click
        def _(_: object) -> None:
            self._playing = not self._playing
            self._button.label = "Pause" if self._playing else "Play"

        with gui.add_folder("Layers"):
            self._layer("Robot", self._bodies.values())
            if self._human is not None:
                self._layer("Human", (self._human, self._bones))
                self._layer("Interaction mesh", (self._edges,), shown=False)
            if self._object is not None:
                self._layer("Object", (self._object,))
            self._contacts_shown = self._layer("Contacts", ())
            self._violations_shown = self._layer("Violations", ())
        self._plots()

    def _layer(self, label: str, handles: Any, shown: bool = True) -> Any:
        box = self.server.gui.add_checkbox(label, shown)

        @box.on_update
        def _(_: object) -> None:
            for handle in handles:
                handle.visible = box.value
            self._draw(self.frame)

        return box

    def _plots(self) -> None:
        from viser import uplot

        report = self.reference.report
        if report is None:
            return
        seconds = np.arange(report.num_frames) / report.fps
        curves = {"penetration, mm": 1e3 * report.surroundings_penetration}
        if report.energy is not None:
            curves["deformation energy, ×10⁻³"] = 1e3 * report.energy
        if (planted := report.stance.get("default")) is not None:
            slip = np.where(planted, np.nan_to_num(report.slip), 0.0)
            curves["slip of planted feet, cm/s"] = 1e2 * slip.max(axis=1)
        with self.server.gui.add_folder("Report"):
            for label, curve in curves.items():
                self.server.gui.add_uplot(
                    (seconds, np.asarray(curve, float)),
                    (uplot.Series(label="s"), uplot.Series(label=label, stroke="#0072B2", width=1)),
                    scales={"x": uplot.Scale(time=False)},
                    aspect=3.0,
                )

    def _draw(self, frame: int) -> None:
        reference = self.reference
        frame = min(frame, reference.num_frames - 1)
        with self.server.atomic():
            self._follow(frame)
            for body, handle in self._bodies.items():
                index = reference.body_names.index(body)
                handle.position = reference.body_positions[frame, index]
                handle.wxyz = reference.body_quaternions[frame, index]
            if self._object is not None and reference.object_poses is not None:
                self._object.position = reference.object_poses[frame, :3]
                self._object.wxyz = reference.object_poses[frame, 3:]
            source = reference.source
            if source is not None and self._human and self._bones and self._edges:
                self._human.points = source.keypoints[frame].astype(np.float32)
                self._bones.points = source.keypoints[frame][BONES].astype(np.float32)
                if self._edges.visible:
                    self._edges.points = mesh_edges(source, frame).astype(np.float32)
            touched, deep = contact_marks(reference, frame), self._deep[frame]
            alarms = reference.body_positions[frame, deep]
            _place(self._touch, touched, self._contacts_shown.value)
            red = Marks(alarms, np.tile(_ALARM, (len(alarms), 1)))
            _place(self._alarm, red, self._violations_shown.value)
        self._figures.content = self._text(frame)

    def _text(self, frame: int) -> str:
        reference, report = self.reference, self.reference.report
        rows = [f"t = {frame / reference.fps:.2f} s of {reference.duration:.2f} s"]
        feet = zip(SIDES, reference.stance[frame], strict=True)
        planted = [side for side, down in feet if down]
        rows.append(f"planted: {', '.join(planted) or 'none'}")
        touching = [link for link, flags in reference.contacts.items() if flags[frame]]
        rows.append(f"touching: {', '.join(touching) or 'nothing'}")
        if report is not None:
            rows.append(f"penetration {1e3 * report.surroundings_penetration[frame]:.2f} mm")
            if report.energy is not None:
                rows.append(f"deformation energy {1e3 * report.energy[frame]:.1f} × 10⁻³")
            if report.relaxed is not None and report.relaxed[frame]:
                rows.append("**relaxed: the solver gave a constraint up here**")
        return "  \n".join(rows)

    def _look(self, client: Any) -> None:
        """Puts a new visitor where terrain does not hide the robot."""
        client.camera.position, client.camera.look_at = self._view(self.frame)

    def _follow(self, frame: int) -> None:
        """Moves every visitor along with the robot."""
        step = self._root(frame) - self._root(self._seen)
        self._seen = frame
        if not self._following.value or not step.any():
            return
        for client in self.server.get_clients().values():
            position, look_at = client.camera.position, client.camera.look_at
            client.camera.position = position + step
            client.camera.look_at = look_at + step

    def _root(self, frame: int) -> np.ndarray:
        """Where to look: at the robot, steady as it bobs, higher where it climbs."""
        return self._view(frame)[1]

    def _view(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        return camera_pose(self._camera, self._robot, self.reference.qpos[frame])


def _free_port(host: str, port: int) -> int:
    """The port, or the next free one; 0 takes any."""
    error: OSError | None = None
    for candidate in range(port, min(port + _PORTS, 65536)) if port else (0,):
        with socket.socket() as probe:
            try:
                probe.bind((host, candidate))
                return int(probe.getsockname()[1])
            except (OSError, OverflowError) as reason:
                error = reason if isinstance(reason, OSError) else OSError(str(reason))
    raise OmniEnvsError(f"{host}:{port} cannot be listened on: {error}.")


def _place(handles: list[Any], marks: Marks, shown: bool) -> None:
    for i, handle in enumerate(handles):
        here = shown and i < len(marks.points)
        handle.position = marks.points[i] if here else _HIDDEN
        if here:
            handle.color = tuple(int(255 * c) for c in marks.colours[i])


def _title(reference: Reference) -> str:
    name = reference.provenance.get("demonstration", "motion")
    return f"{name} → {get_robot(reference.robot).title}"
