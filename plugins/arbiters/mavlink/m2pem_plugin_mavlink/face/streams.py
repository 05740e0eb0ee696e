"""Messages that are sent by themselves, each at its interval (MAV_CMD_SET_MESSAGE_INTERVAL)."""

import asyncio
import heapq
from collections.abc import Callable, Mapping, Sequence
from itertools import count

from m2pem_plugin_mavlink.face.components import GIMBAL_MAKERS, camera_heartbeat
from m2pem_plugin_mavlink.face.settings import FASTEST_HZ
from m2pem_plugin_mavlink.face.stations import HEARTBEAT, Station, Stations
from m2pem_plugin_mavlink.face.telemetry import MAKERS
from m2pem_plugin_mavlink.face.vehicle import ShownVehicle
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type

LONGEST_WAIT_S = 0.05
SENT_AT_ONCE = 64
"""Messages that are sent before other tasks run."""

MOST_INTERVALS = 256
"""Most intervals of its own that a station may set."""

SHORTEST_S = 1 / FASTEST_HZ
LONGEST_S = 3600.0

_Entry = tuple[float, int, Station | None, ShownVehicle, int]


def messages_of(vehicle: ShownVehicle, id_: int) -> list[tuple[Message, Address]]:
    """Return the messages of an id that a vehicle's components send now, with their senders."""
    found: list[tuple[Message, Address]] = []
    if (maker := MAKERS.get(id_)) is not None and (message := maker(vehicle)) is not None:
        found.append((message, vehicle.autopilot))
    if id_ == HEARTBEAT:
        for camera in vehicle.cameras:
            found.append((camera_heartbeat(), Address(vehicle.system, camera.component)))
    elif (make := GIMBAL_MAKERS.get(id_)) is not None:
        for camera in vehicle.cameras:
            if camera.gimbal_device:
                found.append((make(camera), vehicle.autopilot))
    return found


def is_known(id_: int) -> bool:
    """Return whether vehicles have messages of an id."""
    return id_ in MAKERS or id_ in GIMBAL_MAKERS


class Streams:
    """`rates_hz`: by the name of the message, for stations that set no other."""

    def __init__(
        self,
        stations: Stations,
        vehicles: Sequence[ShownVehicle],
        rates_hz: Mapping[str, float],
        now_s: Callable[[], float],
    ) -> None:
        self._stations = stations
        self._vehicles = vehicles
        self._default_s = {message_type(name).id: 1 / rate for name, rate in rates_hz.items()}
        self.now_s = now_s
        self._queue: list[_Entry] = []
        self._numbers = count()
        self._sent = 0

    def interval_s(self, station: Station, vehicle: ShownVehicle, id_: int) -> float:
        """Return the interval of a message to a station; 0: it is not sent."""
        own = station.intervals_s.get((vehicle.system, id_))
        return self._default_s.get(id_, 0.0) if own is None else own

    def set_interval(
        self, station: Station, vehicle: ShownVehicle, id_: int, interval_s: float
    ) -> bool:
        """Set the interval to a station. 0: the default one; below it: none. Intervals that are too
        short become the shortest. Return False if the station has set too many."""
        own, key = station.intervals_s, (vehicle.system, id_)
        if key not in own and len(own) >= MOST_INTERVALS and interval_s != 0:
            return False
        station.queued.pop(key, None)
        if interval_s == 0:
            own.pop(key, None)
            return True
        own[key] = min(max(interval_s, SHORTEST_S), LONGEST_S) if interval_s > 0 else 0.0
        if own[key]:
            self._push(self.now_s(), station, vehicle, id_)
            self._drop_replaced()
        return True

    async def run(self) -> None:
        """Send messages until cancelled."""
        now_s = self.now_s()
        for number, vehicle in enumerate(self._vehicles):
            for id_, interval_s in self._default_s.items():
                self._push(now_s + interval_s * number / len(self._vehicles), None, vehicle, id_)
        while True:
            now_s = self.now_s()
            while self._queue and self._queue[0][0] <= now_s:
                await self._send(heapq.heappop(self._queue), now_s)
            due_s = self._queue[0][0] if self._queue else now_s + LONGEST_WAIT_S
            await asyncio.sleep(min(max(due_s - self.now_s(), 0.0), LONGEST_WAIT_S))

    def _push(self, due_s: float, station: Station | None, vehicle: ShownVehicle, id_: int) -> None:
        number = next(self._numbers)
        if station is not None:
            station.queued[vehicle.system, id_] = number
        heapq.heappush(self._queue, (due_s, number, station, vehicle, id_))

    def _drop_replaced(self) -> None:
        """Bound the queue: a station may change its intervals often, and long ones stay long."""
        in_use = len(self._default_s) * len(self._vehicles)
        in_use += sum(len(station.queued) for station in self._stations)
        if len(self._queue) > in_use + MOST_INTERVALS:
            self._queue = [each for each in self._queue if self._is_queued(each)]
            heapq.heapify(self._queue)

    def _is_queued(self, entry: _Entry) -> bool:
        """Return whether no later entry has replaced this one, and its station is there."""
        _, number, station, vehicle, id_ = entry
        if station is None:
            return True
        return station.peer.open and station.queued.get((vehicle.system, id_)) == number

    async def _send(self, entry: _Entry, now_s: float) -> None:
        due_s, _, station, vehicle, id_ = entry
        key = vehicle.system, id_
        if not self._is_queued(entry):
            return
        if station is None:
            interval_s = self._default_s[id_]
            stations = [each for each in self._stations if key not in each.intervals_s]
        else:
            if key not in station.intervals_s:
                return
            interval_s = self.interval_s(station, vehicle, id_)
            stations = [station]
        if not interval_s:
            return
        if vehicle.present and stations:
            for message, source in messages_of(vehicle, id_):
                for each in stations:
                    each.send(message, source)
                    self._sent += 1
        if self._sent >= SENT_AT_ONCE:
            self._sent = 0
            await asyncio.sleep(0)
        # After a suspension of the machine, skip what was missed.
        next_s = due_s + interval_s
        self._push(next_s if next_s > now_s else now_s + interval_s, station, vehicle, id_)
