"""A driver for tests of the node on board: its vehicle is time, and what is asked for its script.

`hold` takes its duration, and does not go on while it is held; `drive_stop` succeeds at once;
`reverse` fails; `follow` ends when its target is known; the others go on until they are ended, or
adjusted to a speed above 5 m/s, and say that REST is left if they are to `loop`. Its mode is how
often it has begun something.
"""

import asyncio
from collections.abc import Mapping
from uuid import UUID

from m2pem_plugin_ros.drivers.driver import DriverEvents, Health, Order, Outcome

from m2pem.api import (
    BehaviorRequest,
    BehaviorState,
    Clock,
    FleetBus,
    Point,
    ResolvedValue,
    VehiclePosition,
)

TICK_S = 0.01
DONE = Outcome(BehaviorState.SUCCEEDED)
REST = {"route": "rest", "speed": 2.0}


class ScriptedDriver:
    """Implements `Driver`."""

    def __init__(self, events: DriverEvents, bus: FleetBus, clock: Clock) -> None:
        self.events = events
        self.bus = bus
        self.clock = clock
        self.begun = 0
        self.held = False
        self.deaf = False
        self._order: Order | None = None
        self._left_s = 0.0
        self._task: asyncio.Task[None] | None = None

    async def open(self) -> None:
        self._task = asyncio.get_running_loop().create_task(self._live())

    @property
    def health(self) -> Health:
        return Health(f"begun {self.begun}", True, (), 0.5)

    def refusal(self, request: BehaviorRequest) -> str:
        target = request.parameters.get("target")
        far = isinstance(target, Point) and target.position[0] > 80.0
        return "the pole is too far" if far else ""

    def begin(self, order: Order) -> None:
        if order.request.behavior == "teleop":
            raise RuntimeError("no joystick")
        self.begun += 1
        self.held = False
        self._order = order
        self._left_s = float(order.request.parameters.get("duration") or 0.0)  # type: ignore[arg-type]
        self.events.progress(order.goal)
        if order.request.behavior == "drive_stop":
            self._over(DONE)
        elif order.request.behavior == "reverse":
            self._over(Outcome(BehaviorState.FAILED, "ROUTE_BLOCKED", "a wall"))
        elif order.request.parameters.get("loop") is True:
            self.events.remains(order.goal, REST)

    def end(self, goal: object) -> None:
        if self._order is not None and self._order.goal == goal:
            self._over(Outcome(BehaviorState.CANCELLED))

    def adjust(self, goal: object, parameters: Mapping[str, ResolvedValue]) -> None:
        speed = parameters.get("speed")
        if isinstance(speed, float) and speed > 5.0:
            self._over(Outcome(BehaviorState.SUCCEEDED, reason=f"at {speed:g} m/s"))

    def hold(self) -> None:
        self.held = True

    def resume(self) -> None:
        self.held = False

    async def query(self, order: Order) -> Outcome:
        return Outcome(BehaviorState.UNKNOWN)

    def claim(self, run: UUID, epoch: int) -> None: ...

    def abandon(self) -> None:
        self._order = None

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _live(self) -> None:
        while True:
            if not self.deaf:
                self.events.alive()
            order = self._order
            if order is not None and order.request.behavior == "hold" and not self.held:
                self._left_s -= TICK_S
                if self._left_s <= 0.0:
                    self._over(DONE)
            target = order.request.parameters.get("target") if order is not None else None
            if isinstance(target, VehiclePosition):
                state = self.bus.latest(target.vehicle)  # type: ignore[arg-type]
                if state is not None:
                    self._over(Outcome(BehaviorState.SUCCEEDED, reason=f"found {state.resource}"))
            await self.clock.sleep(TICK_S)

    def _over(self, outcome: Outcome) -> None:
        order, self._order = self._order, None
        if order is not None:
            self.events.ended(order.goal, outcome)
