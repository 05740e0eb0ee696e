"""Controls one vehicle: one behavior at a time, from its beginning to its end.

A new behavior, a hold or a cancel takes effect at once: the work before it is cancelled, an
exchange in flight too, and only then is something else sent.
"""

import asyncio
import logging
import math
from dataclasses import dataclass

from m2pem.api import BehaviorId, BehaviorState, BehaviorTracker, LatestTask, LatLon, Limits
from m2pem_plugin_mavlink.behaviors.arrival import (
    STANDS_BELOW_M_S,
    StillnessTimer,
    accepted_modes,
    distance_to_m,
    on_the_ground,
    position_of,
    stays_at,
)
from m2pem_plugin_mavlink.behaviors.behavior import (
    Behavior,
    BehaviorFailedError,
    TakenOverError,
)
from m2pem_plugin_mavlink.behaviors.takeoff_landing import Land, ReturnToLaunch, SetSpeed
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError
from m2pem_plugin_mavlink.vehicle.autopilot import ModeLeftError
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.takeover_monitor import (
    SETTLES_S,
    TEXTS_BEFORE_S,
    Cause,
    TakeoverMonitor,
)
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

LOOK_EVERY_S = 0.2
"""The interval at which a behavior is checked for completion."""

LEAST_PROGRESS_M = 1.0
"""What is left of a behavior that fails or is lost is reported if so much was done since."""

KNOWN_WITHIN_S = 5.0
RESTS_BELOW_M_S = 1.0
DRIFTS_BELOW_M_S = 2.0
"""A vehicle that is slower, one on water that drifts, obeys a stop; gusts and waves move it."""

OBEYS_WITHIN_S = 10.0
"""From 15 m/s a copter brakes in 5 s."""

PUSHED_M = 15.0
"""A vehicle that another station has paused is moved by gusts, but not so far."""

STOP_SHARE = 0.8
"""The share of the cancel timeout after which a stop has failed."""

_FAILSAFES = frozenset({FlightMode.RETURN, FlightMode.LAND})
"""Modes that autopilots enter by themselves when a link is lost, besides stopping."""
_HELD = frozenset({FlightMode.HOLD})


@dataclass(slots=True)
class _NewSpeed:
    """A speed for a behavior that goes on. `answer`: "" when the vehicle has taken it, or need not
    any more; else why it goes on at another one."""

    m_s: float
    answer: asyncio.Future[str]

    def answered(self, wrong: str = "") -> None:
        if not self.answer.done():
            self.answer.set_result(wrong)


@dataclass(slots=True)
class _ActiveBehavior:
    """The behavior that is active. `begun`: the vehicle executes it; `reattached`: it was found on
    the vehicle after a restart, and nothing need be sent. `speed`: to be sent to the vehicle; None:
    nothing is. `waits`: why it waits for another station, and where the vehicle came to rest."""

    id: BehaviorId
    behavior: Behavior
    begun: bool = False
    reattached: bool = False
    cancelled: bool = False
    speed: _NewSpeed | None = None
    waits: str = ""
    waits_at: LatLon | None = None


class VehicleController:
    """Controls a vehicle; reports what becomes of its behaviors to the tracker."""

    def __init__(
        self,
        vehicle: Vehicle,
        takeover_monitor: TakeoverMonitor,
        tracker: BehaviorTracker,
        limits: Limits,
        logger: logging.Logger,
    ) -> None:
        self.vehicle = vehicle
        self.cruise_m_s: float | None = None
        self._takeover_monitor = takeover_monitor
        self._tracker = tracker
        self._limits = limits
        self._logger = logger
        self._active: _ActiveBehavior | None = None
        self._held = False
        self._was_commanded = False
        self._work = LatestTask()

    @property
    def behavior(self) -> str:
        """The name of the active behavior, or ""."""
        return self._active.behavior.name if self._active is not None else ""

    async def wait_until_known(self, within_s: float) -> bool:
        """Wait until the kind of vehicle, its position and whether it flies are known; False: not
        within this time."""
        state = self.vehicle.state
        return await self.vehicle.identified(within_s) and await self.vehicle.until(
            lambda: state.position is not None and state.landed is not None, within_s
        )

    # --- requests -------------------------------------------------------------------------------

    def start(self, id_: BehaviorId, behavior: Behavior, *, look_first: bool = False) -> None:
        """Execute a behavior in place of the active one.

        `look_first`: it may have been begun before a restart; then it is not begun again.
        """
        before = self._active
        self._active = active = _ActiveBehavior(id_, behavior)
        self._held = False
        self._was_commanded = True
        self._takeover_monitor.begin()
        self._work.replace(
            lambda: self._run(active, before.behavior if before else None, look_first)
        )

    def adopt(self, id_: BehaviorId, behavior: Behavior) -> None:
        """Continue a behavior that the vehicle was found to execute."""
        self._active = active = _ActiveBehavior(id_, behavior, begun=True, reattached=True)
        self._held = False
        self._was_commanded = True
        self._work.replace(lambda: self._run(active))

    def cancel(self, id_: BehaviorId) -> None:
        """Stop the vehicle, and free it."""
        active = self._active
        if active is not None and active.id == id_ and not active.cancelled:
            active.cancelled = True
            self._work.replace(lambda: self._cancel(active))

    def adjust(self, id_: BehaviorId, speed_m_s: float) -> asyncio.Future[str]:
        """Change the speed of the behavior; while it is held, the change takes effect when it is
        resumed. Return the vehicle's answer: "", or why it goes on at another speed."""
        new = _NewSpeed(speed_m_s, asyncio.get_running_loop().create_future())
        active = self._active
        if active is None or active.id != id_:
            new.answered()  # it is over
        elif not active.behavior.adjust(speed_m_s):
            new.answered(f"{active.behavior.name} has no speed that could be changed")
        else:
            if active.speed is not None:
                active.speed.answered()  # the new one counts
            active.speed = new
        return new.answer

    def hold(self) -> None:
        """Stop the vehicle, and keep the behavior."""
        active = self._active
        if active is not None and active.cancelled:
            return  # it is being stopped already
        if active is None and self._is_in_failsafe:
            self._logger.warning(
                "%s: not held: it returns or lands by itself", self.vehicle.resource
            )
            return
        if active is not None and not self._held:
            active.behavior.paused()
        self._held = True
        self._work.replace(lambda: self._hold_still(active))

    def resume(self) -> None:
        """Continue the behavior."""
        active, held = self._active, self._held
        self._held = False
        if active is not None and held:
            self._work.replace(lambda: self._run(active))
        elif held:
            self._work.cancel()  # it may still wait to be received, to be held then

    def release(self) -> None:
        """Forget the behavior of a vehicle that is lost, or that another executive commands; what
        was seen of it last is reported."""
        if self._active is not None:
            self._report_left(self._active, LEAST_PROGRESS_M)
        self._active = None
        self._held = False
        self._work.cancel()

    async def reclaim(self) -> str:
        """Stop a vehicle that is connected again. Return "" when it has acknowledged, else why
        it is not free: RTL or LAND is not interrupted, as autopilots start them when a link is
        lost."""
        self.release()
        if not await self.wait_until_known(KNOWN_WITHIN_S):
            return "its link is up again, but it has not reported its mode yet"
        state, driver = self.vehicle.state, self.vehicle.driver
        mode = "" if state.custom_mode is None else driver.mode_name(state.custom_mode)
        if state.armed and state.mode in _FAILSAFES and not self._stands():
            return f"its link is up again; {mode} is not interrupted: free when it stops"
        # PX4 uses the same mode to go to a place and to stay there.
        stands = (
            state.mode is FlightMode.HOLD
            and state.custom_mode != self.vehicle.commanded.custom_mode
        )
        steered = stands or state.mode in _FAILSAFES or state.mode is FlightMode.MANUAL
        if self._was_commanded and state.armed and not steered:
            try:
                await self._stop()
            except ExchangeError as error:
                return f"its link is up again; it is in {mode}, and does not stop: {error}"
        self._was_commanded = False
        return ""

    def mark_commanded(self) -> None:
        """Note that the vehicle may execute a command from before a restart, and could not be
        asked."""
        self._was_commanded = True

    def _stands(self) -> bool:
        """Return whether the vehicle has stopped; one that flies has not, though it may hover."""
        if self.vehicle.domain == "air":
            return on_the_ground(self.vehicle)
        velocity = self.vehicle.state.velocity_enu_m_s
        return velocity is not None and math.hypot(*velocity) < STANDS_BELOW_M_S

    async def close(self) -> None:
        """Leave the vehicle as it is."""
        await self._work.close()

    # --- execution ------------------------------------------------------------------------------

    async def _run(
        self, active: _ActiveBehavior, before: Behavior | None = None, look_first: bool = False
    ) -> None:
        try:
            await self._wait_until_received()
            if before is not None:
                await self._clean_up_before(before, active.behavior)
            if look_first and await active.behavior.reattach() is BehaviorState.RUNNING:
                active.begun = active.reattached = True
            await self._begin_or_resume(active)
            await self._wait_until_finished(active)
        except TakenOverError as error:
            self._end(active, BehaviorState.FAILED, error.code, error.reason)
        except BehaviorFailedError as error:
            await self._fail(active, error.reason, error.code)
        except ModeLeftError as error:
            await self._end_taken_over(active, error.reason)
        except ExchangeError as error:
            await self._fail(active, error.reason)
        except asyncio.CancelledError:
            raise
        except Exception as error:  # an error of one vehicle must not block its mission
            self._logger.exception("%s: %s", self.vehicle.resource, active.behavior.name)
            await self._fail(active, f"internal error of m2pem: {type(error).__name__}: {error}")
        else:
            if isinstance(active.behavior, SetSpeed):
                self.cruise_m_s = active.behavior.speed_m_s
            self._end(active, BehaviorState.SUCCEEDED, reason=active.behavior.result())

    async def _wait_until_received(self) -> None:
        """Wait for the first messages of the vehicle; one that never sends any is LOST. A vehicle
        without a position is commanded all the same: its driver says why it is not ready."""
        if not await self.wait_until_known(KNOWN_WITHIN_S):
            await self.vehicle.until(lambda: self.vehicle.identity is not None)

    async def _clean_up_before(self, before: Behavior, after: Behavior) -> None:
        """End the motion before a behavior that does not move the vehicle; otherwise clean up."""
        if after.moves_vehicle:
            await before.clean_up()
        elif before.moves_vehicle:
            await self._stop()

    async def _begin_or_resume(self, active: _ActiveBehavior) -> None:
        if active.reattached:
            active.reattached = False
        elif active.begun:
            await active.behavior.resume()
        else:
            await active.behavior.begin()
            active.begun = True
        self._tracker.progress(active.id)

    async def _wait_until_finished(self, active: _ActiveBehavior) -> None:
        create = asyncio.get_running_loop().create_task
        steps, speeds = (
            create(active.behavior.run_in_background()),
            create(self._send_speeds(active)),
        )
        stillness = StillnessTimer(active.behavior.context)
        try:
            # Check for these first: a vehicle that fell looks like one that has landed.
            while not self._has_restarted_or_fallen() and not active.behavior.finished():
                if steps.done():
                    steps.result()
                waits = self._check_takeover(accepted_modes(active.behavior), active.behavior.name)
                self._note_waiting(active, waits or active.behavior.waits())
                if active.waits:
                    stillness.forget()
                self._check_progress(active.behavior, stillness)
                self._report_left(active)
                await self.vehicle.sleep(LOOK_EVERY_S)
        finally:
            for task in (steps, speeds):
                task.cancel()
            await asyncio.gather(steps, speeds, return_exceptions=True)

    async def _send_speeds(self, active: _ActiveBehavior) -> None:
        """Send new speeds beside the behavior, whose end must not wait for them; the newest
        counts."""
        while True:
            speed, active.speed = active.speed, None
            if speed is not None:
                try:
                    speed.answered(await self._speed_refusal(speed.m_s))
                finally:
                    speed.answered()  # the behavior is over, or held: then it is sent again
            await self.vehicle.sleep(LOOK_EVERY_S)

    async def _speed_refusal(self, speed_m_s: float) -> str:
        """Send a speed; return "", or why the vehicle goes on at another one."""
        try:
            await self.vehicle.driver.set_speed(speed_m_s)
        except NoAnswerError as error:
            return f"it has not acknowledged {speed_m_s:g} m/s ({error})"
        except ExchangeError as error:
            return f"it does not take {speed_m_s:g} m/s, and goes on at its old speed ({error})"
        return ""

    def _report_left(self, active: _ActiveBehavior, least_m: float | None = None) -> None:
        left = active.behavior.left(least_m)
        if left is not None:
            self._tracker.remains(active.id, left)

    def _check_takeover(self, modes: frozenset[FlightMode], behavior: str = "") -> str:
        """Return why the vehicle rightly waits for another station; "" if it does not.

        Raises:
            TakenOverError: it was taken over.
        """
        if takeover := self._takeover_monitor.takeover(modes, behavior):
            if takeover.cause is Cause.PAUSE:
                return takeover.reason
            code = "TAKEN_OVER"
            if takeover.cause is Cause.FAILSAFE:
                code = "BATTERY_LOW" if "batt" in takeover.reason.lower() else "FAILED"
            raise TakenOverError(takeover.reason, code)
        return ""

    def _note_waiting(self, active: _ActiveBehavior, waits: str) -> None:
        """Tell operators when a behavior begins and ends to wait for another station.

        Raises:
            TakenOverError: that station moves the vehicle meanwhile.
        """
        vehicle = self.vehicle
        if waits and not active.waits:
            vehicle.warn(f"{waits}: {active.behavior.name} goes on when that station continues it")
        elif active.waits and not waits:
            vehicle.warn("goes on: it was continued")
        active.waits = waits
        if not waits:
            active.waits_at = None
        elif active.waits_at is None and self._rests(None):
            active.waits_at = position_of(vehicle)
        elif active.waits_at is not None and distance_to_m(vehicle, active.waits_at) > PUSHED_M:
            raise TakenOverError("another ground station has paused it, and moves it")

    async def _end_taken_over(self, active: _ActiveBehavior, reason: str) -> None:
        """End a behavior that was taken over while it was prepared, with the cause once it is
        known."""
        code = "TAKEN_OVER"
        end_s = self.vehicle.link.now_s() + SETTLES_S + LOOK_EVERY_S
        try:
            while self.vehicle.link.now_s() < end_s:
                self._check_takeover(accepted_modes(active.behavior))
                await self.vehicle.sleep(LOOK_EVERY_S)
        except TakenOverError as error:
            code, reason = error.code, error.reason
        self._end(active, BehaviorState.FAILED, code, reason)

    def _has_restarted_or_fallen(self) -> bool:
        """Return False.

        Raises:
            TakenOverError: it has.
        """
        monitor = self._takeover_monitor
        if failure := monitor.restarted() or monitor.fallen():
            raise TakenOverError(failure.reason, "FAILED")
        return False

    def _check_progress(self, behavior: Behavior, stillness: StillnessTimer) -> None:
        bound_s = behavior.max_still_s
        if bound_s is None or stillness.seconds() < bound_s:
            return
        vehicle = self.vehicle
        mode = vehicle.driver.mode_name(vehicle.state.custom_mode or 0)
        said = "; ".join(vehicle.recent_texts(bound_s + TEXTS_BEFORE_S))
        raise BehaviorFailedError(
            f"it should move, but has not moved for {bound_s:g} s, in {mode}"
            + (f"; it said: {said}" if said else "")
        )

    async def _hold_still(self, active: _ActiveBehavior | None) -> None:
        try:
            await self._stop_once_received()
            at, end_s = position_of(self.vehicle), self.vehicle.link.now_s() + OBEYS_WITHIN_S
            judged = self._is_in_failsafe
            while not (active is None and judged) and not self._has_restarted_or_fallen():
                judged = judged or self._rests(at)
                if not judged and self.vehicle.link.now_s() >= end_s:
                    judged = True
                    self.vehicle.alarm(self._disobedience("hold"))
                # A vehicle that is held before it has left the ground disarms itself after a while.
                if active is not None and not on_the_ground(self.vehicle):
                    self._check_takeover(_HELD)
                await self.vehicle.sleep(LOOK_EVERY_S)
        except TakenOverError as error:
            if active is not None:
                self._end(active, BehaviorState.FAILED, error.code, error.reason)
        except ExchangeError as error:
            self._logger.error("%s: cannot be held: %s", self.vehicle.resource, error)

    async def _stop_once_received(self) -> None:
        """Stop the vehicle. One that is silent may still execute a command from before: it is
        stopped when it is received, unless a pilot steers it by then."""
        vehicle = self.vehicle
        while True:
            if vehicle.identity is not None:
                try:
                    await self._stop()
                except ExchangeError as error:
                    if vehicle.is_received:
                        raise
                    self._logger.warning(
                        "%s: not held before it is received again: %s", vehicle.resource, error
                    )
                else:
                    return
            await vehicle.until(lambda: vehicle.is_received)
            if vehicle.state.mode is FlightMode.MANUAL:
                return

    async def _cancel(self, active: _ActiveBehavior) -> None:
        stop = asyncio.get_running_loop().create_task(self._stop_until_at_rest())
        limit_s = STOP_SHARE * self._limits.cancel_timeout_s
        late = asyncio.get_running_loop().create_task(self.vehicle.sleep(limit_s))
        try:
            await asyncio.wait([stop, late], return_when=asyncio.FIRST_COMPLETED)
            if not stop.done():
                reason = f"the vehicle did not stop within {limit_s:g} s of the cancel: "
                reason += self._disobedience("cancel")
                self._end(active, BehaviorState.FAILED, "TIMEOUT", reason)
            elif (error := stop.exception()) is not None:
                self._end(active, BehaviorState.FAILED, "", f"the vehicle did not stop: {error}")
            elif self._is_in_failsafe:
                reason = "the vehicle returns or lands by itself, and was not interrupted"
                self._end(active, BehaviorState.FAILED, "TAKEN_OVER", reason)
            else:
                self._end(active, BehaviorState.CANCELLED)
        finally:
            for task in (stop, late):
                task.cancel()
            await asyncio.gather(stop, late, return_exceptions=True)

    async def _stop_until_at_rest(self) -> None:
        """Stop the vehicle; return when it is seen to obey."""
        await self._stop()
        at = position_of(self.vehicle)
        if not self._is_in_failsafe:
            await self.vehicle.until(lambda: self._rests(at))

    def _rests(self, at: LatLon | None) -> bool:
        """Return whether the vehicle is slow enough for a stopped one; what cannot stop circles
        around `at`. One that reports no velocity is not judged."""
        vehicle = self.vehicle
        below_m_s = DRIFTS_BELOW_M_S if vehicle.domain == "surface" else RESTS_BELOW_M_S
        known = vehicle.state.armed and vehicle.state.velocity_enu_m_s is not None
        slow = vehicle.state.speed_m_s < below_m_s
        return not known or slow or on_the_ground(vehicle) or stays_at(vehicle, at)

    def _disobedience(self, command: str) -> str:
        """Return what operators read of a vehicle that does not stop."""
        state = self.vehicle.state
        mode = self.vehicle.driver.mode_name(state.custom_mode or 0)
        speed = "" if math.isinf(state.speed_m_s) else f" at {state.speed_m_s:.1f} m/s"
        return f"it does NOT obey the {command}, in {mode}{speed}; take it over by remote control"

    @property
    def _is_in_failsafe(self) -> bool:
        """Return whether the vehicle returns or lands without a command from here: by a failsafe,
        or by a person."""
        state, active = self.vehicle.state, self._active
        if not state.armed or state.mode not in _FAILSAFES:
            return False
        return not self._takeover_monitor.mode_is_commanded(
            accepted_modes(active.behavior) if active else ()
        )

    async def _stop(self) -> None:
        """Stop the vehicle, unless it executes a failsafe of its own."""
        if not await self.vehicle.identified(0.0):
            return
        if self._is_in_failsafe:
            state = self.vehicle.state
            mode = self.vehicle.driver.mode_name(state.custom_mode or 0)
            self._logger.warning(
                "%s: not stopped: it is in %s, which m2pem did not command",
                self.vehicle.resource,
                mode,
            )
            return
        await self.vehicle.driver.stop()

    async def _fail(self, active: _ActiveBehavior, reason: str, code: str = "") -> None:
        """End a behavior that has failed half-way: stop the motion, but not a return or a landing,
        nor a vehicle that is on the ground."""
        state = self.vehicle.state
        comes_down = isinstance(active.behavior, Land | ReturnToLaunch) and state.mode in _FAILSAFES
        try:
            if active.behavior.moves_vehicle and state.landed is not True and not comes_down:
                await self._stop()
        except ExchangeError as error:
            self._logger.error("%s: the vehicle does not stop: %s", self.vehicle.resource, error)
        self._end(active, BehaviorState.FAILED, code, reason)

    def _end(
        self, active: _ActiveBehavior, state: BehaviorState, code: str = "", reason: str = ""
    ) -> None:
        if self._active is active:
            self._active = None
        if state is BehaviorState.FAILED:
            self._report_left(active, LEAST_PROGRESS_M)
        self._tracker.end(active.id, state, code, reason)
