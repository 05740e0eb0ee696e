"""One vehicle: its state, its driver, and waiting for what it reports."""

import asyncio
import logging
import math
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Clock, LinkState, ResourceId, VehicleState
from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage, SetMessageInterval
from m2pem_plugin_mavlink.microservices.texts import GIVE_UP_S, StatusTexts, Text
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, RefusedError
from m2pem_plugin_mavlink.signing.signature import Refusal
from m2pem_plugin_mavlink.vehicle.ardupilot import ArdupilotDriver
from m2pem_plugin_mavlink.vehicle.autopilot import Autopilot
from m2pem_plugin_mavlink.vehicle.driver import Readiness
from m2pem_plugin_mavlink.vehicle.fixed_wing import WINGED, assume_default_radii, read_radii
from m2pem_plugin_mavlink.vehicle.identity import ON_THE_GROUND, Firmware, Identity, identity
from m2pem_plugin_mavlink.vehicle.modes import modes_of
from m2pem_plugin_mavlink.vehicle.px4 import Px4Driver
from m2pem_plugin_mavlink.vehicle.state import (
    DEGRADED_SHARE,
    AutopilotState,
    CommandedState,
    link_state,
)
from m2pem_plugin_mavlink.vehicle.streams import RequestedStreams, telemetry_streams
from m2pem_plugin_mavlink.vehicle.telemetry_decoder import TelemetryDecoder


class ConditionWaiters:
    """Tasks that wait for conditions. Call `check` whenever a condition may have become true."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._waiting: dict[asyncio.Future[bool], Callable[[], bool]] = {}

    def check(self) -> None:
        """Wake the tasks whose condition is true, or raises."""
        for future, true in tuple(self._waiting.items()):
            if future.done():
                continue
            try:
                if true():
                    future.set_result(True)
            except Exception as error:
                future.set_exception(error)

    async def wait(self, true: Callable[[], bool], within_s: float | None = None) -> bool:
        """Wait until `true()`, which may raise; return False after `within_s`."""
        if true():
            return True
        loop = asyncio.get_running_loop()
        future: asyncio.Future[bool] = loop.create_future()
        self._waiting[future] = true
        alarm = None if within_s is None else loop.create_task(self._alarm(within_s, future))
        try:
            return await future or true()
        finally:
            del self._waiting[future]
            if alarm is not None:
                alarm.cancel()

    async def _alarm(self, within_s: float, future: "asyncio.Future[bool]") -> None:
        await self._clock.sleep(within_s)
        if not future.done():
            future.set_result(False)


_DRIVERS: Mapping[Firmware, type[Autopilot]] = {
    Firmware.ARDUPILOT: ArdupilotDriver,
    Firmware.PX4: Px4Driver,
}
_HEARTBEAT = message_type("HEARTBEAT").id
_STATUSTEXT = message_type("STATUSTEXT").id
_HOME = message_type("HOME_POSITION").id

_WARNING: int = dialect.MAV_SEVERITY_WARNING

RECEIVED_S = 3.0
"""A vehicle whose last message is older is silent; each sends a heartbeat every second."""

SAID_AGAIN_S = 300.0
"""A warning of the autopilot that comes again within this time is not shown again."""

_REMEDIES = {
    Refusal.NOT_SIGNED: "`m2pem mavlink signing setup` gives the vehicle the key",
    Refusal.WRONGLY_SIGNED: "the sender has another key than the fleet",
    Refusal.REPLAYED: "recorded frames are sent again, or two links have the same frames",
    Refusal.TOO_OLD: "recorded frames are sent again, or its clock is behind by a minute or more",
}

RADII_EVERY_S = 10.0
"""Seconds between two requests for the radii of a vehicle's circles."""

HOME_EVERY_S = 5.0
"""Seconds between two requests for a home position."""


class Vehicle:
    """A vehicle of the fleet behind its link, between `open` and `close`.

    Nothing is sent before its heartbeat has identified it; then the messages for `state` are
    requested, and again when they stop. All times are of the arbiter's clock. `avoids_obstacles`:
    the autopilot plans ways around obstacles by itself.
    """

    def __init__(
        self,
        resource: ResourceId,
        domain: str,
        link: VehicleLink,
        clock: Clock,
        *,
        lost_after_s: float = 3.0,
        logger: logging.Logger | None = None,
    ) -> None:
        self.resource = resource
        self.domain = domain
        self.link = link
        self.state = AutopilotState()
        self.commanded = CommandedState()
        self.texts = StatusTexts(self._warn_of)
        self._warned_s: dict[str, float] = {}
        self._refused_s: dict[tuple[str, Refusal], float] = {}
        self.identity: Identity | None = None
        self.avoids_obstacles = False
        self.lost_after_s = lost_after_s
        self._clock = clock
        self._logger = logger or logging.getLogger(__name__)
        self._driver: Autopilot | None = None
        self._decoder: TelemetryDecoder | None = None
        self._streams: RequestedStreams | None = None
        self._waiters = ConditionWaiters(clock)
        self._watchers: list[Callable[[], None]] = []
        self._stop_listening: list[Callable[[], None]] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._asking = False
        self._boots = 0
        self._unsupported = False
        self._mistaken_s = -math.inf
        self._home_requested_s = -math.inf

    # --- life -----------------------------------------------------------------------------------

    def open(self) -> None:
        """Subscribe to the vehicle's messages."""
        self._stop_listening.append(self.link.listen((_HEARTBEAT,), self._identify))
        self._stop_listening.append(self.link.listen((_STATUSTEXT,), self._read_text))
        self._go(self._watch_silence())

    async def close(self) -> None:
        """Unsubscribe; the vehicle continues what it does."""
        for deafen in self._stop_listening:
            deafen()
        self._stop_listening.clear()
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def watch(self, watcher: Callable[[], None]) -> Callable[[], None]:
        """Call `watcher` whenever a message was received or the vehicle has fallen silent, until
        the returned function is called."""
        self._watchers.append(watcher)
        return lambda: self._watchers.remove(watcher) if watcher in self._watchers else None

    # --- state ----------------------------------------------------------------------------------

    @property
    def driver(self) -> Autopilot:
        """The driver of its autopilot.

        Raises:
            NoAnswerError: it has not sent a heartbeat yet.
        """
        if self._driver is None:
            raise NoAnswerError(f"{self.resource} has sent no message yet")
        return self._driver

    @property
    def silent_s(self) -> float | None:
        """Seconds since the last message; None: no message was ever received."""
        return None if self.state.at_s is None else self.link.now_s() - self.state.at_s

    @property
    def is_received(self) -> bool:
        """Whether a message was received just now."""
        return self.silent_s is not None and self.silent_s < RECEIVED_S

    @property
    def link_state(self) -> LinkState:
        """The state of the link."""
        quality = self.link.quality()
        return link_state(self.silent_s, self.lost_after_s, quality.loss if quality else 0.0)

    def refused_frames(self) -> str:
        """Return which of its frames were refused since the last message, and why; "" if none."""
        since_s = -math.inf if self.state.at_s is None else self.state.at_s
        by_url: dict[str, list[str]] = {}
        for each in self.link.refused():
            if each.last_s > since_s:
                by_url.setdefault(each.url, []).append(f"{each.refusal} ({each.count})")
        system, component = self.link.address
        return "; ".join(
            f"frames of {system}/{component} on {url} refused: {', '.join(reasons)}"
            for url, reasons in by_url.items()
        )

    def warn_of_refused_frames(self) -> bool:
        """Show operators new reasons for which frames are refused; return whether there are."""
        warned = False
        for each in self.link.refused():
            before_s = self._refused_s.get((each.url, each.refusal), -math.inf)
            if each.last_s - before_s < SAID_AGAIN_S:
                continue
            self._refused_s[each.url, each.refusal] = each.last_s
            warned = True
            system, component = self.link.address
            self._logger.warning(
                "%s: frames of %d/%d on %s refused: %s (%d); %s",
                self.resource, system, component, each.url, each.refusal, each.count,
                _REMEDIES[each.refusal],
            )  # fmt: skip
        return warned

    def telemetry(self) -> VehicleState:
        """Return the present state for the fleet."""
        state, driver, link = self.state, self._driver, self.link_state
        if link is LinkState.LOST and (refused := self.refused_frames()):
            readiness: Readiness | None = Readiness(False, (refused,))
        else:
            readiness = driver.readiness() if driver is not None else None
        number = state.custom_mode
        return VehicleState(
            self.resource,
            self._clock.now_us(),
            state.position,
            state.altitude_above_home_m,
            state.velocity_enu_m_s,
            state.roll_rad or 0.0,
            state.pitch_rad or 0.0,
            state.yaw_rad,
            state.battery_fraction,
            driver.mode_name(number) if driver is not None and number is not None else "",
            state.armed,
            readiness.ready if readiness else None,
            readiness.reasons if readiness else (),
            link,
            landed=state.landed if self.domain == "air" else None,
            home=state.home,
        )

    def recent_texts(self, within_s: float = 5.0) -> tuple[str, ...]:
        """Return the last texts (STATUSTEXT), newest last: the reasons of refusals."""
        return tuple(each.text for each in self.texts.recent(self.link.now_s(), within_s))

    # --- waiting --------------------------------------------------------------------------------

    async def identified(self, within_s: float) -> bool:
        """Wait until a heartbeat has reported the autopilot and the kind of vehicle."""
        return await self.until(lambda: self._driver is not None, within_s)

    async def until(self, true: Callable[[], bool], within_s: float | None = None) -> bool:
        """Wait until a condition is true; it is checked at each message. Return False after
        `within_s` of the arbiter's clock."""
        return await self._waiters.wait(true, within_s)

    async def sleep(self, seconds: float) -> None:
        """Wait, by the arbiter's clock."""
        await self._clock.sleep(seconds)

    # --- receiving ------------------------------------------------------------------------------

    def _identify(self, message: Message, sender: Address) -> None:
        if sender != self.link.address:
            return
        found = identity(message.autopilot, message.type)
        if self.identity is not None:
            now_s = self.link.now_s()
            if found != self.identity and now_s - self._mistaken_s >= SAID_AGAIN_S:
                self._mistaken_s = now_s
                self._logger.warning(
                    "%s: was %s and now reports that it is %s; do two vehicles have system id %d?",
                    self.resource, self.identity, found or "an unknown vehicle", sender.system,
                )  # fmt: skip
            return
        if found is None:
            self._warn_of_unsupported(message.autopilot, message.type)
            return
        self._logger.info("%s: %s, system id %d", self.resource, found, sender.system)
        self.identity = found
        flies = found.kind not in ON_THE_GROUND
        if flies != (self.domain == "air"):
            self._logger.warning(
                "%s: the fleet says %s, its heartbeat %s", self.resource, self.domain, found.kind
            )
        self._driver = _DRIVERS[found.firmware](self, found)
        self._streams = RequestedStreams(telemetry_streams(found.firmware))
        self._decoder = TelemetryDecoder(self.state, modes_of(found), flies=flies)
        if found.kind in WINGED:
            assume_default_radii(self.state, found)
            self._go(self._ask_for_radii(found))
        self._receive(message, sender)
        self._stop_listening.append(self.link.listen(self._decoder.wants, self._receive))

    def _warn_of_unsupported(self, autopilot: int, type_: int) -> None:
        if not self._unsupported:
            self._unsupported = True
            self._logger.warning(
                "%s: system id %d is not a vehicle with ArduPilot or PX4: autopilot %d, type %d",
                self.resource, self.link.address.system, autopilot, type_,
            )  # fmt: skip

    def _receive(self, message: Message, sender: Address) -> None:
        if sender != self.link.address or self._decoder is None or self._streams is None:
            return
        self._decoder.take(message, self.link.now_s())
        if self.state.boots != self._boots:
            self._boots = self.state.boots
            self._streams.forget()
        if message.TYPE.id == _HEARTBEAT:
            self._ask_for_streams()
            self.texts.give_up(self.link.now_s() - GIVE_UP_S)
        self._notify_watchers()

    def _read_text(self, message: Message, sender: Address) -> None:
        if sender == self.link.address:
            self.texts.take(message, sender, self.link.now_s())
            self._notify_watchers()

    def _warn_of(self, text: Text) -> None:
        """Show operators the warnings of the autopilot. It repeats the reasons against arming every
        30 s."""
        now_s = self.link.now_s()
        said_s = self._warned_s.get(text.text)
        if text.severity > _WARNING or (said_s is not None and now_s - said_s < SAID_AGAIN_S):
            return
        self._warned_s = {
            each: at_s for each, at_s in self._warned_s.items() if now_s - at_s < SAID_AGAIN_S
        }
        self._warned_s[text.text] = now_s
        self.warn(f"says: {text.text}")

    def alarm(self, text: str) -> None:
        """Show operators at once what they must act on."""
        self._logger.critical("%s %s", self.resource, text)

    def warn(self, text: str) -> None:
        """Show operators a text about the vehicle."""
        self._logger.warning("%s %s", self.resource, text)

    def _notify_watchers(self) -> None:
        self._waiters.check()
        for watcher in tuple(self._watchers):
            watcher()

    async def _watch_silence(self) -> None:
        """Check conditions and call watchers also when messages stop."""
        while True:
            silent_s = self.silent_s
            if silent_s is None or silent_s >= self.lost_after_s:
                before_s = self.state.at_s
                await self.until(lambda before_s=before_s: self.state.at_s != before_s)  # type: ignore[misc]
                continue
            bounds_s = (DEGRADED_SHARE * self.lost_after_s, self.lost_after_s)
            ahead_s = min(bound - silent_s for bound in bounds_s if bound > silent_s)
            await self._clock.sleep(max(ahead_s, 0.001))
            if self.link_state is not LinkState.CONNECTED:
                self._notify_watchers()

    # --- requests of streams --------------------------------------------------------------------

    def _ask_for_streams(self) -> None:
        assert self._streams is not None
        if self._asking:
            return
        due = self._streams.due(self.state.messages_s, self.link.now_s())
        now_s = self.link.now_s()
        if due:
            self._asking = True
            self._go(self._ask(self._streams, due))
        elif (
            _HOME in self._streams.refused
            and self.state.home is None
            and now_s - self._home_requested_s >= HOME_EVERY_S
        ):
            self._home_requested_s, self._asking = now_s, True
            self._go(self._ask_for_home())

    async def _ask(self, streams: RequestedStreams, due: list[int]) -> None:
        try:
            for id_ in due:
                request = SetMessageInterval(self.link.address, id_, streams.wanted[id_])
                try:
                    await self.link.perform(request)
                except RefusedError as error:
                    if not error.temporary:
                        streams.refused.add(id_)
                    self._logger.debug("%s: sends no message %d: %s", self.resource, id_, error)
                except ExchangeError as error:
                    streams.unanswered(id_)
                    self._logger.debug("%s: message %d: %s", self.resource, id_, error)
                else:
                    streams.requested(id_, self.link.now_s())
        finally:
            self._asking = False

    async def _ask_for_home(self) -> None:
        request = RequestMessage(self.link.address, "HOME_POSITION", lambda message: message)
        try:
            await self.link.perform(request)
        except ExchangeError as error:
            self._logger.debug("%s: its home is not known: %s", self.resource, error)
        finally:
            self._asking = False

    async def _ask_for_radii(self, found: Identity) -> None:
        while True:
            try:
                await read_radii(self.state, found, self.link)
            except ExchangeError as error:
                self._logger.debug(
                    "%s: the radii of its circles are not known: %s", self.resource, error
                )
                await self._clock.sleep(RADII_EVERY_S)
            else:
                return

    def _go(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
