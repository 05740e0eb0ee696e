"""Who steers one vehicle: one behavior at a time, from its beginning to its end.

Whatever is asked of it (a new behavior, a hold, a cancel) takes effect at once: what was being done
for it before, an exchange in flight too, is given up, and only then something else is sent.
"""

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from m2pem.api import BehaviorId, BehaviorState, BehaviorTracker, Limits
from m2pem_plugin_mavlink.behaviors.behavior import Behavior, BehaviorFailedError
from m2pem_plugin_mavlink.behaviors.flight import Land, ReturnToLaunch, SetSpeed
from m2pem_plugin_mavlink.behaviors.looking import (
    STANDS_BELOW_M_S,
    Standing,
    modes_of,
    on_the_ground,
)
from m2pem_plugin_mavlink.foreign import TEXTS_BEFORE_S, Cause, TakeoverWatch
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

LOOK_EVERY_S = 0.2
"""So often is a behavior asked whether it is finished."""

KNOWN_WITHIN_S = 5.0
STOP_SHARE = 0.8
"""Of the time in which a cancelled vehicle must be free: a stop that takes longer has failed."""

_FAILSAFES = frozenset({FlightMode.RETURN, FlightMode.LAND})
"""What autopilots do by themselves when a link is lost, beside standing (BRAKE, HOLD, LOITER)."""
_HELD = frozenset({FlightMode.HOLD})
_FAIL_SAFE = frozenset({FlightMode.RETURN, FlightMode.LAND})


@dataclass(slots=True)
class _Flight:
    """A behavior that goes on. `begun`: the vehicle does it; `looked`: it was recognised on a
    vehicle that had it already, and nothing need be sent. `speed_m_s`: to be told to the vehicle
    while it goes on; None: nothing is."""

    id: BehaviorId
    behavior: Behavior
    begun: bool = False
    looked: bool = False
    cancelled: bool = False
    speed_m_s: float | None = None


class Helm:
    """Steers a vehicle; what becomes of it goes to the ledger."""

    def __init__(
        self,
        vehicle: Vehicle,
        watch: TakeoverWatch,
        ledger: BehaviorTracker,
        limits: Limits,
        logger: logging.Logger,
    ) -> None:
        self.vehicle = vehicle
        self.cruise_m_s: float | None = None
        self._watch = watch
        self._ledger = ledger
        self._limits = limits
        self._logger = logger
        self._flight: _Flight | None = None
        self._held = False
        self._given = False
        self._work: set[asyncio.Task[None]] = set()

    @property
    def behavior(self) -> str:
        """The name of what it does now, or ""."""
        return self._flight.behavior.name if self._flight is not None else ""

    async def knows(self, within_s: float) -> bool:
        """Wait until it is known what the vehicle is, where it is and whether it flies; False: it
        was not within so many seconds."""
        heard = self.vehicle.heard
        return await self.vehicle.identified(within_s) and await self.vehicle.until(
            lambda: heard.position is not None and heard.landed is not None, within_s
        )

    # --- what may be asked ----------------------------------------------------------------------

    def take(self, id_: BehaviorId, behavior: Behavior, *, look_first: bool = False) -> None:
        """Do this from now on, in place of what it does.

        `look_first`: it may have been begun before a restart; then it is not begun again.
        """
        before = self._flight
        self._flight = flight = _Flight(id_, behavior)
        self._held = False
        self._given = True
        self._watch.begin()
        self._replace(lambda: self._fly(flight, before.behavior if before else None, look_first))

    def adopt(self, id_: BehaviorId, behavior: Behavior) -> None:
        """The vehicle was found doing it, and is to go on."""
        self._flight = flight = _Flight(id_, behavior, begun=True, looked=True)
        self._held = False
        self._given = True
        self._replace(lambda: self._fly(flight))

    def cancel(self, id_: BehaviorId) -> None:
        """Stop, and be free."""
        flight = self._flight
        if flight is not None and flight.id == id_ and not flight.cancelled:
            flight.cancelled = True
            self._replace(lambda: self._cancel(flight))

    def adjust(self, id_: BehaviorId, speed_m_s: float) -> None:
        """Go on at another speed; who is held does so when it goes on."""
        flight = self._flight
        if flight is not None and flight.id == id_ and flight.behavior.adjust(speed_m_s):
            flight.speed_m_s = speed_m_s

    def hold(self) -> None:
        """Stand still, and keep the behavior."""
        flight = self._flight
        if flight is not None and flight.cancelled:
            return  # it is being stopped already
        if flight is None and self._fails_safe:
            self._logger.warning(
                "%s: not held: it returns or lands by itself", self.vehicle.resource
            )
            return
        if flight is not None and not self._held:
            flight.behavior.paused()
        self._held = True
        self._replace(lambda: self._stand(flight))

    def resume(self) -> None:
        """Go on with the behavior."""
        flight, held = self._flight, self._held
        self._held = False
        if flight is not None and held:
            self._replace(lambda: self._fly(flight))

    def drop(self) -> None:
        """It cannot be reached: its behavior is nobody's any more."""
        self._flight = None
        self._held = False
        for task in self._work:
            task.cancel()

    async def reclaim(self) -> str:
        """It is heard again: have it stop what it was given before. Returns "" when it has
        acknowledged, else why it is not free: RTL or LAND is not interrupted, as a lost link makes
        autopilots do that by themselves."""
        self.drop()
        if not await self.knows(KNOWN_WITHIN_S):
            return "it is heard again, and does not say yet what it does"
        heard, driver = self.vehicle.heard, self.vehicle.driver
        mode = "" if heard.custom_mode is None else driver.mode_name(heard.custom_mode)
        if heard.armed and heard.mode in _FAILSAFES and not self._stands():
            return f"it is heard again in {mode}, which is not interrupted: free when it stands"
        # PX4 goes to a place in the mode in which it also stands.
        stands = (
            heard.mode is FlightMode.HOLD and heard.custom_mode != self.vehicle.ours.custom_mode
        )
        steered = stands or heard.mode in _FAILSAFES or heard.mode is FlightMode.MANUAL
        if self._given and heard.armed and not steered:
            try:
                await self._stop()
            except ExchangeError as error:
                return f"it is heard again in {mode}, and does not stop: {error}"
        self._given = False
        return ""

    def leave(self) -> None:
        """It may be doing what it was given before a restart, and could not be asked."""
        self._given = True

    def _stands(self) -> bool:
        """One that flies does not stand, though it may hover for a while."""
        if self.vehicle.domain == "air":
            return on_the_ground(self.vehicle)
        velocity = self.vehicle.heard.velocity_enu_m_s
        return velocity is not None and math.hypot(*velocity) < STANDS_BELOW_M_S

    async def close(self) -> None:
        """Leave the vehicle as it is."""
        tasks = list(self._work)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # --- one thing at a time --------------------------------------------------------------------

    def _replace(self, work: Callable[[], Awaitable[None]]) -> None:
        before = set(self._work)
        for task in before:
            task.cancel()
        task = asyncio.get_running_loop().create_task(self._after(before, work))
        self._work.add(task)
        task.add_done_callback(self._work.discard)

    async def _after(
        self, before: set[asyncio.Task[None]], work: Callable[[], Awaitable[None]]
    ) -> None:
        if before:
            await asyncio.wait(before)
        await work()

    # --- what is done ---------------------------------------------------------------------------

    async def _fly(
        self, flight: _Flight, before: Behavior | None = None, look_first: bool = False
    ) -> None:
        try:
            await self._heard()
            if before is not None:
                await self._make_way(before, flight.behavior)
            if look_first and await flight.behavior.recognised() is BehaviorState.RUNNING:
                flight.begun = flight.looked = True
            await self._set_out(flight)
            await self._until_finished(flight)
        except BehaviorFailedError as error:
            await self._fail(flight, error.reason, error.code)
        except _TakenOverError as error:
            self._over(flight, BehaviorState.FAILED, error.code, error.reason)
        except ExchangeError as error:
            await self._fail(flight, error.reason)
        except asyncio.CancelledError:
            raise
        except Exception as error:  # one vehicle's bug must not hang its mission
            self._logger.exception("%s: %s", self.vehicle.resource, flight.behavior.name)
            await self._fail(flight, f"m2pem is wrong: {type(error).__name__}: {error}")
        else:
            if isinstance(flight.behavior, SetSpeed):
                self.cruise_m_s = flight.behavior.speed_m_s
            self._over(flight, BehaviorState.SUCCEEDED)

    async def _heard(self) -> None:
        """Wait for a vehicle that was not heard yet; one that is never heard is LOST. One that
        knows no position yet is asked all the same: its driver says why it is not ready."""
        if not await self.knows(KNOWN_WITHIN_S):
            await self.vehicle.until(lambda: self.vehicle.identity is not None)

    async def _make_way(self, before: Behavior, after: Behavior) -> None:
        """What takes over without steering must not let the old motion go on."""
        if after.steers:
            await before.leave()
        elif before.steers:
            await self._stop()

    async def _set_out(self, flight: _Flight) -> None:
        if flight.looked:
            flight.looked = False
        elif flight.begun:
            await flight.behavior.go_on()
        else:
            await flight.behavior.begin()
            flight.begun = True
        self._ledger.progress(flight.id)

    async def _until_finished(self, flight: _Flight) -> None:
        create = asyncio.get_running_loop().create_task
        steps, telling = create(flight.behavior.steps()), create(self._tell_speeds(flight))
        standing = Standing(flight.behavior.job)
        try:
            # A restart comes first: one that fell from the air looks like one that has landed.
            while not self._has_restarted() and not flight.behavior.finished():
                if steps.done():
                    steps.result()
                self._look(modes_of(flight.behavior))
                self._look_whether_it_moves(flight.behavior, standing)
                await self.vehicle.sleep(LOOK_EVERY_S)
        finally:
            for task in (steps, telling):
                task.cancel()
            await asyncio.gather(steps, telling, return_exceptions=True)

    async def _tell_speeds(self, flight: _Flight) -> None:
        """Beside the behavior, whose end must not wait for it; of several the newest counts."""
        while True:
            speed_m_s, flight.speed_m_s = flight.speed_m_s, None
            if speed_m_s is not None:
                try:
                    await self.vehicle.driver.set_speed(speed_m_s)
                except ExchangeError as error:
                    self._logger.warning("%s keeps its speed: %s", self.vehicle.resource, error)
            await self.vehicle.sleep(LOOK_EVERY_S)

    def _look(self, modes: frozenset[FlightMode]) -> None:
        if takeover := self._watch.taken_over(modes):
            code = "TAKEN_OVER"
            if takeover.cause is Cause.FAILSAFE:
                code = "BATTERY_LOW" if "batt" in takeover.reason.lower() else "FAILED"
            raise _TakenOverError(takeover.reason, code)

    def _has_restarted(self) -> bool:
        """False.

        Raises:
            _TakenOverError: it has.
        """
        if restart := self._watch.restarted():
            raise _TakenOverError(restart.reason, "FAILED")
        return False

    def _look_whether_it_moves(self, behavior: Behavior, standing: Standing) -> None:
        bound_s = behavior.still_s
        if bound_s is None or standing.seconds() < bound_s:
            return
        vehicle = self.vehicle
        mode = vehicle.driver.mode_name(vehicle.heard.custom_mode or 0)
        said = "; ".join(vehicle.recent_texts(bound_s + TEXTS_BEFORE_S))
        raise BehaviorFailedError(
            f"it should be on its way, and has not moved for {bound_s:g} s, in {mode}"
            + (f"; it said: {said}" if said else "")
        )

    async def _stand(self, flight: _Flight | None) -> None:
        try:
            await self._stop()
            while flight is not None and not self._has_restarted():
                # One that is held before it has left the ground disarms itself after a while.
                if not on_the_ground(self.vehicle):
                    self._look(_HELD)
                await self.vehicle.sleep(LOOK_EVERY_S)
        except _TakenOverError as error:
            if flight is not None:
                self._over(flight, BehaviorState.FAILED, error.code, error.reason)
        except ExchangeError as error:
            self._logger.error("%s: cannot be held: %s", self.vehicle.resource, error)

    async def _cancel(self, flight: _Flight) -> None:
        stop = asyncio.get_running_loop().create_task(self._stop())
        limit_s = STOP_SHARE * self._limits.cancel_timeout_s
        late = asyncio.get_running_loop().create_task(self.vehicle.sleep(limit_s))
        try:
            await asyncio.wait([stop, late], return_when=asyncio.FIRST_COMPLETED)
            if not stop.done():
                reason = f"it did not stop within {limit_s:g} s of the cancel"
                self._over(flight, BehaviorState.FAILED, "TIMEOUT", reason)
            elif (error := stop.exception()) is not None:
                self._over(flight, BehaviorState.FAILED, "", f"it would not stop: {error}")
            elif self._fails_safe:
                reason = "it returns or lands by itself, and was not interrupted"
                self._over(flight, BehaviorState.FAILED, "TAKEN_OVER", reason)
            else:
                self._over(flight, BehaviorState.CANCELLED)
        finally:
            for task in (stop, late):
                task.cancel()
            await asyncio.gather(stop, late, return_exceptions=True)

    @property
    def _fails_safe(self) -> bool:
        """Whether it returns or lands, and was not asked for that here: a failsafe, or a person.
        After a restart it is held when its behavior is not recognised."""
        heard, flight = self.vehicle.heard, self._flight
        if not heard.armed or heard.mode not in _FAIL_SAFE:
            return False
        return not self._watch.mode_is_ours(modes_of(flight.behavior) if flight else ())

    async def _stop(self) -> None:
        """Have it stand; a failsafe of its own goes on, whatever ends here."""
        if not await self.vehicle.identified(0.0):
            return
        if self._fails_safe:
            heard = self.vehicle.heard
            mode = self.vehicle.driver.mode_name(heard.custom_mode or 0)
            self._logger.warning(
                "%s: not stopped: it is in %s, not asked for here", self.vehicle.resource, mode
            )
            return
        await self.vehicle.driver.stop()

    async def _fail(self, flight: _Flight, reason: str, code: str = "") -> None:
        """What has failed half-way must not go on, but a return or a landing; a vehicle that stands
        is left as it is."""
        heard = self.vehicle.heard
        comes_down = isinstance(flight.behavior, Land | ReturnToLaunch) and heard.mode in _FAIL_SAFE
        try:
            if flight.behavior.steers and heard.landed is not True and not comes_down:
                await self._stop()
        except ExchangeError as error:
            self._logger.error("%s: does not stop: %s", self.vehicle.resource, error)
        self._over(flight, BehaviorState.FAILED, code, reason)

    def _over(
        self, flight: _Flight, state: BehaviorState, code: str = "", reason: str = ""
    ) -> None:
        if self._flight is flight:
            self._flight = None
        self._ledger.end(flight.id, state, code, reason)


class _TakenOverError(Exception):
    """Somebody else steers: nothing more is sent."""

    def __init__(self, reason: str, code: str) -> None:
        super().__init__(reason)
        self.reason = reason
        self.code = code
