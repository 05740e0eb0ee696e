"""A vehicle made of a script, in virtual time, behind a link without sockets."""

import asyncio
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from m2pem_plugin_mavlink.link.vehicle_link import Listener
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.quality import LinkQuality
from m2pem_plugin_mavlink.protocol.transaction import Transaction
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Clock, ResourceId

T = TypeVar("T")

ACCEPTED, DENIED, FAILED = (
    dialect.MAV_RESULT_ACCEPTED,
    dialect.MAV_RESULT_DENIED,
    dialect.MAV_RESULT_FAILED,
)
OWN = Address(245, 190)
UAV1 = ResourceId("uav1")
HOME = (473977420, 85455940, 488_000)
READY_FLAGS, WAITING_FLAGS = 0x33F, 0xA7
GUIDED, AUTO, STABILIZE, LOITER, BRAKE, RTL = 4, 3, 0, 5, 17, 6


def make(name: str, **fields: Any) -> Message:
    message: Message = message_type(name).make(**fields)
    return message


class ScriptedLink:
    """A VehicleLink whose vehicle is this script: `obey` has a function for each MAV_CMD, which
    returns a MAV_RESULT or None (no answer); `sent` has all that was sent to it."""

    def __init__(self, clock: Clock, autopilot: int, type_: int) -> None:
        self.clock = clock
        self.address = Address(1, 1)
        self.autopilot, self.type = autopilot, type_
        self.sent: list[Any] = []
        self.loss = 0.0
        self.obey: dict[int, Callable[[Any], int | None]] = {
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            dialect.MAV_CMD_DO_SET_MODE: self._set_mode,
            dialect.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
        }
        self.custom_mode, self.armed = STABILIZE, False
        self.intervals: dict[int, float] = {}
        self.says: dict[str, dict[str, Any]] = {}
        self._listeners: list[tuple[frozenset[int], Listener]] = []
        self._locks: dict[Any, asyncio.Lock] = {}
        self._tasks: list[asyncio.Task[None]] = []
        self._awaiting: list[tuple[Transaction[Any], asyncio.Event]] = []

    # --- VehicleLink ----------------------------------------------------------------------------

    def now_s(self) -> float:
        return self.clock.now_us() / 1e6

    def send(self, message: Message) -> None:
        self.sent.append(message)
        if message.TYPE.name in ("COMMAND_LONG", "COMMAND_INT"):
            result = self.obey.get(message.command, lambda _: ACCEPTED)(message)
            if result is not None:
                ack = make(
                    "COMMAND_ACK",
                    command=message.command,
                    result=result,
                    target_system=OWN.system,
                    target_component=OWN.component,
                )
                asyncio.get_running_loop().call_later(0.01, self.hear, ack)

    async def perform(self, transaction: Transaction[T]) -> T:
        async with self._locks.setdefault(transaction.key, asyncio.Lock()):
            news = asyncio.Event()
            entry = (transaction, news)
            self._awaiting.append(entry)
            transaction.source = OWN
            try:
                transaction.begin(self.now_s())
                while True:
                    for message in transaction.outbox:
                        self.send(message)
                    transaction.outbox.clear()
                    if transaction.done:
                        return transaction.outcome()
                    await self._news(transaction, news)
            finally:
                self._awaiting.remove(entry)

    async def _news(self, transaction: Transaction[Any], news: asyncio.Event) -> None:
        deadline_s = transaction.deadline_s
        left_s = None if deadline_s is None else max(deadline_s - self.now_s(), 1e-6)
        try:
            await asyncio.wait_for(news.wait(), left_s)
        except TimeoutError:
            if not transaction.done:
                transaction.expire(max(self.now_s(), deadline_s or 0.0))
        news.clear()

    def refused(self) -> tuple[()]:
        return ()

    def quality(self) -> LinkQuality | None:
        return LinkQuality(self.loss, 20.0, 0.0)

    def listen(self, ids: Iterable[int], listener: Listener) -> Callable[[], None]:
        entry = (frozenset(ids), listener)
        self._listeners.append(entry)
        return lambda: self._listeners.remove(entry)

    # --- the vehicle ----------------------------------------------------------------------------

    def hear(self, message: Message, sender: Address | None = None) -> None:
        """The vehicle (or another sender) says something."""
        sender = sender or self.address
        id_ = message.TYPE.id
        for transaction, news in tuple(self._awaiting):
            if id_ in transaction.wants and not transaction.done:
                transaction.receive(message, sender, self.now_s())
                news.set()
        for ids, listener in tuple(self._listeners):
            if id_ in ids:
                listener(message, sender)

    def say(self, text: str) -> None:
        self.hear(make("STATUSTEXT", text=text.encode(), severity=4))

    def heartbeat(self) -> None:
        self.hear(
            make(
                "HEARTBEAT",
                type=self.type,
                autopilot=self.autopilot,
                base_mode=1 | (dialect.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0),
                custom_mode=self.custom_mode,
            )
        )

    def switch_on(self) -> None:
        """A heartbeat a second, and what was asked for of what it `says`."""
        self._tasks.append(asyncio.get_running_loop().create_task(self._live()))

    async def switch_off(self) -> None:
        tasks, self._tasks = self._tasks, []
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self.intervals.clear()

    async def _live(self) -> None:
        tick = 0
        while True:
            if tick % 4 == 0:
                self.heartbeat()
            for name, fields in self.says.items():
                interval_s = self.intervals.get(message_type(name).id)
                if interval_s is not None and tick % max(round(interval_s / 0.25), 1) == 0:
                    self.hear(make(name, **fields))
            tick += 1
            await self.clock.sleep(0.25)

    def _set_interval(self, message: Any) -> int:
        self.intervals[int(message.param1)] = message.param2 / 1e6
        return ACCEPTED

    def _set_mode(self, message: Any) -> int:
        px4 = self.autopilot == dialect.MAV_AUTOPILOT_PX4
        main, sub = int(message.param2), int(message.param3)
        self.custom_mode = main << 16 | sub << 24 if px4 else main
        return ACCEPTED

    def _arm(self, message: Any) -> int:
        self.armed = bool(message.param1)
        return ACCEPTED

    def of(self, name: str, command: int | None = None) -> list[Any]:
        """What was sent of one kind."""
        named = [message for message in self.sent if message.TYPE.name == name]
        return [each for each in named if command is None or each.command == command]


def ready_to_fly(link: ScriptedLink) -> None:
    """It has a position, and stands at home."""
    latitude, longitude, altitude = HOME
    link.says = {
        "SYS_STATUS": {"battery_remaining": 90},
        "GPS_RAW_INT": {"fix_type": 6},
        "ATTITUDE": {"time_boot_ms": 60_000, "yaw": 0.5},
        "LOCAL_POSITION_NED": {"time_boot_ms": 60_000},
        "GLOBAL_POSITION_INT": {
            "time_boot_ms": 60_000,
            "lat": latitude,
            "lon": longitude,
            "alt": altitude,
        },
        "EKF_STATUS_REPORT": {"flags": READY_FLAGS},
        "ESTIMATOR_STATUS": {"flags": READY_FLAGS},
        "HOME_POSITION": {"latitude": latitude, "longitude": longitude, "altitude": altitude},
        "EXTENDED_SYS_STATE": {"landed_state": dialect.MAV_LANDED_STATE_ON_GROUND},
    }


def fail_its_checks(link: ScriptedLink, text: str) -> None:
    """It cannot be armed, and says why when it is asked."""
    check = dialect.MAV_SYS_STATUS_PREARM_CHECK
    link.says["SYS_STATUS"] = {
        "onboard_control_sensors_present": check,
        "onboard_control_sensors_enabled": check,
        "battery_remaining": 90,
    }

    def say(_: Any) -> int:
        link.say(text)
        return ACCEPTED

    link.obey[dialect.MAV_CMD_RUN_PREARM_CHECKS] = say


def fly(link: ScriptedLink, height_m: float = 10.0) -> None:
    """It is in the air."""
    ready_to_fly(link)
    link.armed = True
    link.says["GLOBAL_POSITION_INT"]["relative_alt"] = round(height_m * 1000)
    link.says["GLOBAL_POSITION_INT"]["alt"] += round(height_m * 1000)
    link.says["EXTENDED_SYS_STATE"] = {"landed_state": dialect.MAV_LANDED_STATE_IN_AIR}


def copter(clock: Clock) -> tuple[ScriptedLink, Vehicle]:
    return _vehicle(clock, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, dialect.MAV_TYPE_QUADROTOR, "air")


def rover(clock: Clock) -> tuple[ScriptedLink, Vehicle]:
    return _vehicle(
        clock, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, dialect.MAV_TYPE_GROUND_ROVER, "ground"
    )


def plane(clock: Clock) -> tuple[ScriptedLink, Vehicle]:
    return _vehicle(clock, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, dialect.MAV_TYPE_FIXED_WING, "air")


def px4(clock: Clock) -> tuple[ScriptedLink, Vehicle]:
    return _vehicle(clock, dialect.MAV_AUTOPILOT_PX4, dialect.MAV_TYPE_QUADROTOR, "air")


def _vehicle(clock: Clock, autopilot: int, type_: int, domain: str) -> tuple[ScriptedLink, Vehicle]:
    link = ScriptedLink(clock, autopilot, type_)
    ready_to_fly(link)
    return link, Vehicle(UAV1, domain, link, clock)


class Playing:
    """`async with Playing(copter(clock)) as (link, vehicle)`: both are on, and the vehicle is known
    and tells all that it says."""

    def __init__(self, pair: tuple[ScriptedLink, Vehicle]) -> None:
        self.pair = pair

    async def __aenter__(self) -> tuple[ScriptedLink, Vehicle]:
        link, vehicle = self.pair
        vehicle.open()
        link.switch_on()
        assert await vehicle.identified(5.0)
        assert await vehicle.until(
            lambda: not link.says or vehicle.state.home is not None or vehicle.state.changes > 40,
            20.0,
        )
        return self.pair

    async def __aexit__(self, *_: object) -> None:
        link, vehicle = self.pair
        await vehicle.close()
        await link.switch_off()
