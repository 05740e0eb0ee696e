"""Detects that another ground station has sent a vehicle in GUIDED somewhere else."""

from m2pem.api import LatLon, distance_m
from m2pem_plugin_mavlink.behaviors.behavior import TakenOverError
from m2pem_plugin_mavlink.protocol.messages import message_type
from m2pem_plugin_mavlink.vehicle.other_stations import Act, Meaning, meaning
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

SHOWS_WITHIN_S = 1.0
"""After a command is acknowledged, an autopilot reports its new target."""

MOVED_M, RAISED_M = 5.0, 2.0

_TARGET = message_type("POSITION_TARGET_GLOBAL_INT").id


class TargetCheck:
    """Compares the target that the autopilot reports with the one that was sent.

    Heights of commands have several frames, that of the report is above mean sea level: it is
    compared with the first report after the command. Not all autopilots report a target; one that
    plans its way around obstacles reports the next place on that way, and is not judged.
    """

    def __init__(self, vehicle: Vehicle, behavior: str) -> None:
        self._vehicle = vehicle
        self._applies = meaning(Act.TARGET, behavior) is Meaning.TAKEN_OVER
        self._sent_s: float | None = None
        self._place: LatLon = (0.0, 0.0)
        self._altitude_m: float | None = None

    def sent(self, place: LatLon | None) -> None:
        """Note a target that the vehicle has accepted; None: another one is on its way to it."""
        self._sent_s = None if place is None or not self._applies else self._vehicle.link.now_s()
        self._place, self._altitude_m = place or (0.0, 0.0), None

    def check(self) -> None:
        """Compare.

        Raises:
            TakenOverError: the target is another one.
        """
        vehicle = self._vehicle
        target, at_s = vehicle.state.target, vehicle.state.messages_s.get(_TARGET)
        if self._sent_s is None or target is None or at_s is None:
            return
        if at_s < self._sent_s + SHOWS_WITHIN_S or vehicle.avoids_obstacles:
            return
        if vehicle.state.custom_mode != vehicle.commanded.custom_mode:
            return  # a mode that was not commanded has targets of its own, and is judged as a mode
        if self._altitude_m is None:
            self._altitude_m = target.altitude_m
        off_m, up_m = distance_m(self._place, target.latlon), target.altitude_m - self._altitude_m
        if off_m > MOVED_M or (vehicle.domain == "air" and abs(up_m) > RAISED_M):
            raise TakenOverError(
                f"another ground station has sent it to {target.latitude_deg:.6f}, "
                f"{target.longitude_deg:.6f}: {off_m:.0f} m from its target"
                + (f", {up_m:+.0f} m in height" if abs(up_m) > RAISED_M else "")
            )
