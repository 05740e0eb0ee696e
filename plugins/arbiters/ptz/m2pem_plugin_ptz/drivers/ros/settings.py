"""The settings of a ROS camera in the fleet file, and the joints of its pan-tilt unit.

The position of a joint is positive counter-clockwise as seen from above, and upwards (REP-103);
`PanTiltZoom` pans clockwise. The position of a zoom joint is the factor.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from m2pem.api import Connection, ConnectionReader
from m2pem_plugin_ptz.gimbal import PanTiltZoom


class Axis(StrEnum):
    """The axis that a joint moves."""

    PAN = "pan"
    TILT = "tilt"
    ZOOM = "zoom"


@dataclass(frozen=True, slots=True)
class Joints:
    """`names`: of each joint, in the order of commands. `backwards`: joints that are mounted the
    other way round."""

    names: Mapping[Axis, str]
    backwards: frozenset[Axis] = frozenset()

    @property
    def zooms(self) -> bool:
        """Whether there is a zoom joint."""
        return Axis.ZOOM in self.names

    def read(self, names: Sequence[str], positions: Sequence[float]) -> dict[Axis, float]:
        """Return the positions of these joints from a message that may have many others."""
        reported = dict(zip(names, positions, strict=False))
        return {
            axis: reported[name]
            for axis, name in self.names.items()
            if name in reported and math.isfinite(reported[name])
        }

    def ptz(self, positions: Mapping[Axis, float], *, endless: bool = False) -> PanTiltZoom | None:
        """Return pan, tilt and zoom; None if a position is missing. `endless`: pan is -pi to pi."""
        if not {Axis.PAN, Axis.TILT} <= positions.keys():
            return None
        pan = -self._signed(Axis.PAN, positions[Axis.PAN])
        tilt = self._signed(Axis.TILT, positions[Axis.TILT])
        zoom = max(1.0, positions.get(Axis.ZOOM, 1.0))
        return PanTiltZoom(math.remainder(pan, math.tau) if endless else pan, tilt, zoom)

    def positions(self, ptz: PanTiltZoom) -> dict[Axis, float]:
        """Return the positions of the joints."""
        wanted = {
            Axis.PAN: self._signed(Axis.PAN, -ptz.pan_rad),
            Axis.TILT: self._signed(Axis.TILT, ptz.tilt_rad),
            Axis.ZOOM: ptz.zoom,
        }
        return {axis: wanted[axis] for axis in self.names}

    def _signed(self, axis: Axis, position: float) -> float:
        return -position if axis in self.backwards else position


def nearest_turn(position_rad: float, to_rad: float) -> float:
    """Return the direction `to_rad` in the turn of an endless joint."""
    return position_rad + math.remainder(to_rad - position_rad, math.tau)


_NAME = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*")
HIGHEST_DOMAIN = 232


class Command(StrEnum):
    """The message that moves the joints: trajectory_msgs/JointTrajectory, or
    std_msgs/Float64MultiArray."""

    TRAJECTORY = "trajectory"
    POSITIONS = "positions"


class Via(StrEnum):
    """How a camera is commanded. A camera inherits the setting of its vehicle's node."""

    JOINTS = "joints"
    TOPICS = "topics"
    ACTION = "action"


COMMAND_TOPICS = {
    Command.TRAJECTORY: "pan_tilt_controller/joint_trajectory",
    Command.POSITIONS: "pan_tilt_controller/commands",
}
"""The names of ros2_control's controllers."""


@dataclass(frozen=True, slots=True)
class RosSettings:
    """Topics have full names. `domain_id` None: that of the environment."""

    joints: Joints
    command: Command
    command_topic: str
    joint_states: str
    image: str
    domain_id: int | None = None


_KEYS = ("via", "namespace", "domain_id", "joints", "command", "command_topic", "joint_states")
_ALL = (*_KEYS, "image")
_JOINTS = ("pan", "tilt", "zoom", "reversed")


def read_settings(connection: Connection) -> RosSettings:
    """Read the settings of one camera.

    Raises:
        PluginError: something is wrong; the text names the resource and the key.
    """
    own = ConnectionReader(connection.resource, connection.settings)
    own.refuse_misspelled(_ALL)
    own.choice("via", Via, Via.JOINTS)
    command = own.choice("command", Command, Command.TRAJECTORY)
    namespace = own.text("namespace", "/").strip("/")
    if namespace and not _NAME.fullmatch(namespace):
        raise own.error("namespace", f"'{namespace}' is not a ROS namespace such as /evsg1")

    def topic(key: str, default: str) -> str:
        name = own.text(key, default)
        if not _NAME.fullmatch(name):
            raise own.error(key, f"'{name}' is not the name of a ROS topic such as {default}")
        return name if name.startswith("/") else f"/{namespace}/{name}".replace("//", "/")

    domain_id = None
    if "domain_id" in own.values:
        domain_id = own.whole("domain_id", None, 0, HIGHEST_DOMAIN, "the ROS domain")
    return RosSettings(
        _joints(own),
        command,
        topic("command_topic", COMMAND_TOPICS[command]),
        topic("joint_states", "joint_states"),
        topic("image", "camera/image_raw/compressed"),
        domain_id,
    )


def _joints(own: ConnectionReader) -> Joints:
    inner = own.inner("joints", "{pan: pan_joint, tilt: tilt_joint}")
    inner.refuse_others(_JOINTS)
    names = {Axis.PAN: inner.text("pan", "pan_joint"), Axis.TILT: inner.text("tilt", "tilt_joint")}
    if "zoom" in inner.values:
        names[Axis.ZOOM] = inner.text("zoom", "zoom_joint")
    if len(set(names.values())) < len(names):
        raise own.error("joints", "two joints have the same name")
    backwards = inner.values.get("reversed", [])
    known = [str(axis) for axis in (Axis.PAN, Axis.TILT)]
    if not isinstance(backwards, list | tuple) or not set(backwards) <= set(known):
        raise inner.error("reversed", f"{backwards!r} is not a list of {' and '.join(known)}")
    return Joints(names, frozenset(Axis(each) for each in backwards))
