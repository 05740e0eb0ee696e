"""Executes the moves of one camera: sends those of `Steering`, polls the direction, stops turns."""

import asyncio
import logging
import math
from collections import deque
from collections.abc import Callable

from m2pem.api import Clock
from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.onvif.capabilities import Capabilities
from m2pem_plugin_ptz.drivers.onvif.session import RefusedError, Session, SilentError
from m2pem_plugin_ptz.drivers.onvif.spaces import Spaces
from m2pem_plugin_ptz.drivers.onvif.steering import (
    TAKES_EFFECT,
    AbsoluteMove,
    ContinuousMove,
    Steering,
)
from m2pem_plugin_ptz.gimbal import PanTiltZoom, Reach

IDLE_S = 0.25
"""Poll period of a camera that need not turn."""

RUNS_ON_S = 1.0
"""A camera stops turning by itself this long after the last command, or after `LAGS_ON` calls."""

LAGS_ON = 4.0
SILENT_CALLS = 3
SILENT_S = 3.0
"""After this many calls and this time without a right answer, the session ends."""

BACKOFF_S = 0.5
ON_ITS_WAY_RAD = math.radians(0.5)
"""A position this far from all that were commanded, and from the last one, is on the way."""

ZOOM_AGAIN_S = 3.0
SAME_ZOOM = 0.02
"""Relative tolerance."""


class Mover:
    """Keeps the last request while the camera is not connected.

    `answered`: the camera has answered since `run` began.
    """

    def __init__(
        self, clock: Clock, logger: logging.Logger, on_contact: Callable[[], None], name: str
    ) -> None:
        self._clock, self._logger, self._on_contact, self._name = clock, logger, on_contact, name
        self.ptz: PanTiltZoom | None = None
        self.says_position = True
        self.answered = False
        self._spaces: Spaces | None = None
        self._steering = Steering(Reach())
        self._request: tuple[float, float, float | None] | None = None
        self._zoom: float | None = None
        self._zoomed_s = -math.inf
        self._halting = False
        self._commanded: deque[tuple[float, float]] = deque(maxlen=8)
        self._shows_its_way = False
        self._news = asyncio.Event()
        self._stops: set[asyncio.Task[None]] = set()
        self._session: Session | None = None
        self._profile = ""
        self._fault = ""

    @property
    def problem(self) -> str:
        """Why the camera does not turn as commanded; "" if it does, or has no command."""
        if self._request is None and self._zoom is None:
            return ""
        if self._steering.stuck:
            return (
                f"{self._name} accepts moves, but does not turn: check whether its head is blocked"
            )
        return self._fault

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None) -> None:
        self._halting = False
        self._request = pan_rad, tilt_rad, rate_rad_s
        self._steering.target.add(pan_rad, tilt_rad, rate_rad_s, self._now_s)
        self._news.set()

    def zoom(self, level: float) -> None:
        self._halting = False
        if self._zoom != level:
            self._zoom, self._zoomed_s = level, -math.inf
        self._news.set()

    def halt(self) -> None:
        """Stop at once, and again when the calls in flight have ended."""
        self._request = self._zoom = None
        self._steering.target.forget()
        self._steering.forget()
        self._halting = True
        self._news.set()
        if self._session is not None:
            task = asyncio.get_running_loop().create_task(self._stop_now(self._session))
            self._stops.add(task)
            task.add_done_callback(self._stops.discard)

    async def run(self, session: Session, capabilities: Capabilities) -> None:
        """Poll and turn the camera as long as it answers.

        Raises:
            CameraError: the camera stopped answering, or its answer is invalid.
        """
        spaces = capabilities.spaces
        self._spaces, self._profile, self._session = spaces, capabilities.profile, session
        if spaces is not None:
            self._steering = Steering(
                spaces.reach, turns=bool(spaces.positions), drives=spaces.velocity is not None
            )
            if self._request is not None:
                self._steering.target.add(*self._request, self._now_s)
        self._zoomed_s = -math.inf
        self._fault, self.answered = "", False
        create = asyncio.get_running_loop().create_task
        tasks = {create(self._watch(session)), create(self._turn(session))}
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            self._session = None
            await cancel_and_wait(*tasks, *self._stops)

    # --- polling --------------------------------------------------------------------------------

    async def _watch(self, session: Session) -> None:
        silent_calls, answered_s = 0, self._now_s
        while True:
            started_s = self._now_s
            try:
                await self._ask(session)
                silent_calls, answered_s, self.answered = 0, self._now_s, True
                self._on_contact()
            except (SilentError, RefusedError):
                silent_calls += 1
                if silent_calls >= SILENT_CALLS and self._now_s - answered_s >= SILENT_S:
                    raise
            busy = self._request is not None or self._zoom is not None or self._halting
            await self._wait(started_s, self._interval_s(session) if busy else IDLE_S)

    async def _ask(self, session: Session) -> None:
        if self._spaces is None:
            await session.call("devicemgmt", "GetSystemDateAndTime")
            self.ptz = PanTiltZoom(0.0, 0.0)  # a camera that does not turn points ahead
            return
        started_s = self._now_s
        status = await session.call("ptz", "GetStatus", ProfileToken=self._profile)
        at_s = (started_s + self._now_s) / 2
        position = getattr(status, "Position", None)
        place, said = getattr(position, "PanTilt", None), getattr(position, "Zoom", None)
        numbers = [] if place is None else [float(place.x), float(place.y)]
        numbers += [] if said is None else [float(said.x)]
        if not all(map(math.isfinite, numbers)):
            raise RefusedError(f"{self._name} reports a position that is not finite: {numbers}")
        found = None
        if place is not None:
            found = self._spaces.ptz(numbers[0], numbers[1], place.space or "")
        self.says_position = found is not None
        if found is not None:
            zoom = None if said is None else self._spaces.zoom(numbers[-1], said.space or "")
            self._steering.observe(*found, at_s)
            moves = self._moves(getattr(status, "MoveStatus", None), found)
            self.ptz = PanTiltZoom(*found, 1.0 if zoom is None else zoom, moves)

    def _moves(self, status: object, found: tuple[float, float]) -> bool:
        """Whether the camera moves, and may report where it will be: some report the commanded
        position at once. One that was seen on its way reports where it is."""
        if "MOVING" not in (getattr(status, "PanTilt", None), getattr(status, "Zoom", None)):
            return False
        last, apart = self.ptz, self._steering.target.apart
        if last is not None:
            others = [*self._commanded, (last.pan_rad, last.tilt_rad)]
            if all(max(map(abs, apart(found, each))) > ON_ITS_WAY_RAD for each in others):
                self._shows_its_way = True
        return not self._shows_its_way

    # --- turning --------------------------------------------------------------------------------

    async def _turn(self, session: Session) -> None:
        while True:
            started_s = self._now_s
            try:
                if not await self._do(session):
                    self._news.clear()
                    if self._request is None and self._zoom is None and not self._halting:
                        await self._news.wait()
                    else:
                        await self._wait(started_s, self._interval_s(session))
                    continue
                self._fault = ""
            except SilentError:
                # `_watch` notices it too, and reports it.
                self._steering.forget()
            except RefusedError as error:
                self._steering.forget()
                if self._fault != error.reason:
                    self._logger.warning("%s", error.reason)
                self._fault = error.reason
                await self._clock.sleep(BACKOFF_S)
            await self._wait(started_s, self._interval_s(session))

    async def _do(self, session: Session) -> bool:
        """Send the next command, and return whether there was one."""
        if self._halting:
            await self._stop(session)
            self._halting = False
            return True
        if self._stops:
            # A stop that arrives after a later move would stop that move.
            await asyncio.wait(self._stops)
        spaces = self._spaces
        if spaces is None:
            return False
        level = self._zoom_to_send(spaces)
        if level is not None:
            self._zoomed_s = self._now_s
            space = spaces.zooms[0]
            zoom = {"x": space.scale.to_units(level), "space": space.uri}
            await self._call(session, "AbsoluteMove", Position={"Zoom": zoom})
            return True
        started_s = self._now_s
        move = self._steering.next(started_s)
        if move is None:
            return False
        if isinstance(move, AbsoluteMove):
            self._commanded.append((move.pan_rad, move.tilt_rad))
            await self._call(session, "AbsoluteMove", **_absolute(spaces, move))
        else:
            await self._call(session, "ContinuousMove", **self._continuous(spaces, move))
        took_s = self._now_s - started_s
        self._steering.measure_call(took_s)
        if self._request is not None:
            self._steering.sent(move, started_s + TAKES_EFFECT * took_s)
        return True

    def _continuous(self, spaces: Spaces, move: ContinuousMove) -> dict[str, object]:
        space = spaces.velocity
        assert space is not None, "`Steering` sends velocities only to a camera that accepts them"
        seconds = max(RUNS_ON_S, LAGS_ON * self._steering.lag_s)
        velocity = {
            "x": space.pan.to_units(move.pan_rad_s),
            "y": space.tilt.to_units(move.tilt_rad_s),
            "space": space.uri,
        }
        return {"Velocity": {"PanTilt": velocity}, "Timeout": f"PT{seconds:.1f}S"}

    def _zoom_to_send(self, spaces: Spaces) -> float | None:
        if self._zoom is None or not spaces.zooms:
            return None
        level = min(max(self._zoom, 1.0), spaces.reach.zoom_max)
        if self._zoomed_s == -math.inf:
            return level
        ptz = self.ptz
        if ptz is None or abs(ptz.zoom - level) <= SAME_ZOOM * level:
            return None
        return level if self._now_s - self._zoomed_s > ZOOM_AGAIN_S else None

    async def _stop_now(self, session: Session) -> None:
        try:
            await self._stop(session)
        except CameraError as error:
            # `_do` sends the stop again.
            self._logger.debug("%s", error.reason)

    async def _stop(self, session: Session) -> None:
        if self._spaces is not None:
            await self._call(session, "Stop", PanTilt=True, Zoom=True)

    async def _call(self, session: Session, operation: str, **arguments: object) -> None:
        await session.call("ptz", operation, ProfileToken=self._profile, **arguments)

    # --- time -----------------------------------------------------------------------------------

    @property
    def _now_s(self) -> float:
        return self._clock.now_us() / 1e6

    def _interval_s(self, session: Session) -> float:
        """Return the call period. Half of the calls poll, half command."""
        return 2.0 / session.settings.calls_s

    async def _wait(self, since_s: float, seconds: float) -> None:
        await self._clock.sleep(max(0.0, since_s + seconds - self._now_s))


def _absolute(spaces: Spaces, move: AbsoluteMove) -> dict[str, object]:
    sent: dict[str, object] = {
        "Position": {"PanTilt": spaces.position(move.pan_rad, move.tilt_rad)}
    }
    if spaces.speed is not None:
        speed = spaces.speed.scale.to_units(move.rate_rad_s)
        sent["Speed"] = {"PanTilt": {"x": speed, "y": speed, "space": spaces.speed.uri}}
    return sent
