"""A simulated autopilot without sockets: give it messages, let time pass, see what it says."""

from collections.abc import Callable
from typing import Any

from m2pem_plugin_mavlink.simulator.autopilot import Autopilot
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from pymavlink.dialects.v20 import ardupilotmega as dialect

GCS = "gcs"
MODES = {
    Kind.COPTER: (4, 3, 6),
    Kind.ROVER: (15, 10, 11),
    Kind.BOAT: (15, 10, 11),
    Kind.PLANE: (15, 10, 11),
}


class Bench:
    """One vehicle and a ground station. `state`: all that it said to `GCS`."""

    def __init__(self, kind: Kind = Kind.COPTER, **options: Any) -> None:
        self.kind = kind
        spec = VehicleSpec(kind, **{"estimator_s": 6.0, **options})
        self.autopilot = Autopilot(spec, step_s=0.05)
        self.received: list[Any] = []
        self.autopilot.meet(GCS)
        self.guided, self.auto, self.rtl = MODES[kind]

    def run(self, seconds: float) -> None:
        """Let time pass."""
        self.autopilot.step(self.autopilot.now_s + seconds)
        self._collect()

    def run_until(self, condition: Callable[[], bool], limit_s: float = 300.0) -> float:
        """Let time pass until something is so; how long it took."""
        start_s = self.autopilot.now_s
        while not condition():
            assert self.autopilot.now_s - start_s < limit_s, "it never happened"
            self.run(0.1)
        return self.autopilot.now_s - start_s

    def tell(
        self, message: Any, *, system: int = 255, component: int = 190, peer: str = GCS
    ) -> list[Any]:
        """Hand over a message through real frames; what the vehicle says at once to that peer."""
        sender = dialect.MAVLink(None, system, component)
        (received,) = dialect.MAVLink(None).parse_buffer(message.pack(sender))
        self.autopilot.receive(received, peer, self.autopilot.now_s)
        return self._collect(peer)

    def command(self, command: int, *params: float, confirmation: int = 0, **sender: Any) -> int:
        """COMMAND_LONG; the result in its acknowledgement."""
        padded = [*params, *[0.0] * (7 - len(params))]
        message = dialect.MAVLink_command_long_message(1, 1, command, confirmation, *padded)
        return self._result(command, self.tell(message, **sender))

    def command_int(
        self, command: int, *params: float, at: tuple[float, float, float], frame: int = 6
    ) -> int:
        """COMMAND_INT with a place; the result in its acknowledgement."""
        padded = [*params, *[0.0] * (4 - len(params))]
        x, y = round(at[0] * 1e7), round(at[1] * 1e7)
        message = dialect.MAVLink_command_int_message(
            1, 1, frame, command, 0, 0, *padded, x, y, at[2]
        )
        return self._result(command, self.tell(message))

    def texts(self) -> list[str]:
        """All that it said to people."""
        return [m.text for m in self.received if m.get_type() == "STATUSTEXT"]

    def report(self, id_: int) -> Any:
        """A message asked for."""
        assert self.command(dialect.MAV_CMD_REQUEST_MESSAGE, id_) == 0
        return next(m for m in reversed(self.received) if m.get_msgId() == id_)

    def offset(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Latitude and longitude of a place so far from home."""
        frame = self.autopilot.frame
        place = frame.to_location(
            self.autopilot.home.point.moved(0, north_m).moved(1.5707963267948966, east_m)
        )
        return place.latitude_deg, place.longitude_deg

    def ready(self) -> "Bench":
        """Armed in GUIDED."""
        self.run_until(lambda: self.autopilot.estimator.ready)
        assert self.command(dialect.MAV_CMD_DO_SET_MODE, 1, self.guided) == 0
        assert self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0
        return self

    def airborne(self, height_m: float = 20.0) -> "Bench":
        """A copter that hovers."""
        self.ready()
        assert self.command(dialect.MAV_CMD_NAV_TAKEOFF, *[0] * 6, height_m) == 0
        self.run_until(lambda: abs(self.autopilot.body.up_m - height_m) < 0.5)
        self.run(3)
        return self

    def upload(self, items: list[Any]) -> int:
        """Upload a plan as a well-behaved ground station; the type of the acknowledgement."""
        answers = self.tell(
            dialect.MAVLink_mission_count_message(
                1, 1, len(items), items[0].mission_type if items else 0
            )
        )
        while True:
            for answer in answers:
                if answer.get_type() == "MISSION_ACK":
                    result: int = answer.type
                    return result
            (request,) = [a for a in answers if a.get_type().startswith("MISSION_REQUEST")]
            answers = self.tell(items[request.seq])

    def _result(self, command: int, answers: list[Any]) -> int:
        (ack,) = [a for a in answers if a.get_type() == "COMMAND_ACK" and a.command == command]
        result: int = ack.result
        return result

    def _collect(self, peer: str = GCS) -> list[Any]:
        """What is in the outbox, as whoever gets it reads it."""
        said = []
        for message, to, component in self.autopilot.take_outbox():
            if message is None or to not in (None, peer):
                continue
            frame = message.pack(dialect.MAVLink(None, self.autopilot.spec.system, component))
            said += dialect.MAVLink(None).parse_buffer(frame)
        self.received += said
        return said


def item(
    seq: int,
    command: int,
    place: tuple[float, float] = (0.0, 0.0),
    z: float = 0.0,
    *params: float,
    frame: int = 6,
    kind: int = 0,
) -> Any:
    """A mission item."""
    padded = [*params, *[0.0] * (4 - len(params))]
    x, y = round(place[0] * 1e7), round(place[1] * 1e7)
    return dialect.MAVLink_mission_item_int_message(
        1, 1, seq, frame, command, 0, 1, *padded, x, y, z, kind
    )
