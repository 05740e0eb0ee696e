"""One vehicle of the arbiter: its link, its state, and the task that it does."""

import asyncio
import logging
import math
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from msgspec import UNSET, UnsetType

from m2pem.api import (
    ArbiterContext,
    BehaviorId,
    BehaviorParameters,
    BehaviorRequest,
    BehaviorState,
    BehaviorTracker,
    Connection,
    GeoPosition,
    Limits,
    LinkState,
    ParameterKind,
    Point,
    ResolvedValue,
    VehicleState,
    find_breach,
    stance_on,
)
from m2pem_plugin_vda5050.catalogue import (
    DRIVING_PARAMETERS,
    STOPS,
    USUAL,
    OwnBehavior,
    Scope,
    lacking,
    why_unsupported,
)
from m2pem_plugin_vda5050.checkpoint import order_id
from m2pem_plugin_vda5050.commander import (
    CancelControl,
    Commander,
    InstantActionCheck,
    PauseControl,
    Publish,
    StopControl,
    action_of,
)
from m2pem_plugin_vda5050.map_frame import MapFrame, MapPoint
from m2pem_plugin_vda5050.messages import (
    SPOKEN,
    Action,
    AgvPosition,
    ConnectionMessage,
    Factsheet,
    Headers,
    MessageError,
    State,
    Velocity,
    Visualization,
    decode,
    other_version,
    seconds_of,
)
from m2pem_plugin_vda5050.orders import OrderPlan, OrderProgress
from m2pem_plugin_vda5050.reading import (
    COMMANDED,
    fatal_errors,
    is_executing,
    is_paused,
    is_paused_by_us,
    not_ready_reasons,
    text_of,
    wrong_position,
)
from m2pem_plugin_vda5050.settings import VERSIONS, Settings
from m2pem_plugin_vda5050.tasks import InstantTask, OrderTask, StopTask, Task, TaskSetup

BROKEN_AFTER_S = 5.0
"""A vehicle whose connection to the broker has broken has so long to come back."""

DEGRADED_SHARE = 0.5
RECLAIM_WITHIN_S = 5.0
"""In real time."""

QUERY_WITHIN_S = 3.0
"""In real time: so long a query waits for the first state of the vehicle."""

RESTARTED_AFTER_S = 5.0
RESTARTED_STATES = 3
"""So many older states in their order, and none else for so long, are those of a vehicle whose
clock was set back."""

OBEYED_WITHIN_S = 0.9
"""In real time. A stop that no state shows by then is said not to be obeyed: the executive alerts
operators after 1 s."""

LOG_AGAIN_AFTER_S = 60.0
OTHER_VERSION = "connection of another major version"
"""What `receive` calls the topic on which a vehicle of another major version says that it is."""


@dataclass(frozen=True, slots=True)
class VehicleSetup:
    """The arguments of a vehicle."""

    connection: Connection
    settings: Settings
    context: ArbiterContext
    tracker: BehaviorTracker
    limits: Limits
    publish: Publish


class Vehicle:
    """Gets the messages of one vehicle, and sends it what its task needs."""

    def __init__(self, setup: VehicleSetup) -> None:
        self.resource = setup.connection.resource
        self.settings = settings = setup.settings
        self.link = LinkState.LOST
        self.first_contact, self.first_answer = asyncio.Event(), asyncio.Event()
        self._context, self._tracker, self._limits = setup.context, setup.tracker, setup.limits
        self._clock = setup.context.clock
        self._logger: logging.Logger = setup.context.logger
        origin = setup.context.origin
        place = settings.map.origin or origin[:2]
        self._frame = MapFrame((*place, origin[2]), settings.map.rotation_rad)
        self._headers = Headers(settings.manufacturer, settings.serial_number, settings.version)
        self._commander = Commander(self._headers, self._clock, setup.publish)
        self._pause = PauseControl(self._commander, self._clock)
        self._check = InstantActionCheck(self._commander, self._clock)
        self._own = {own.spec.name: own for own in settings.own_behaviors}
        self._fence = setup.connection.fence
        self._factsheet: Factsheet | None = None
        self._state: State | None = None
        self._state_us = 0
        self._shown_s: float | None = None
        self._shown_id: int | UnsetType = UNSET
        self._older: list[float] = []
        self._may_be_older = False
        self._place: AgvPosition | None = None
        self._velocity: Velocity | None = None
        self._contact_us = self._clock.now_us()
        self._has_contact = False
        self._broken_us: int | None = None
        self._is_offline = False
        self._task: Task | None = None
        self._left: dict[str, CancelControl | None] = {}
        self._left_us = 0
        self._resolved = asyncio.Event()
        self._news = asyncio.Event()
        self._disobedience = ""
        self._is_held = False
        self._logged_us: dict[str, int] = {}
        self._unlogged: Counter[str] = Counter()
        self._invalid = self._broker_problem = self._other_version = ""

    # --- messages of the vehicle ----------------------------------------------------------------

    def receive(self, topic: str, payload: bytes) -> VehicleState | None:
        """Process a message. Return the new state for the fleet; None: nothing new is known."""
        if not payload:  # a client has cleared what the broker retained: MQTT 3.1.1, 3.3.1.3
            return None
        try:
            match topic:
                case "state":
                    return self._receive_state(payload)
                case "visualization":
                    return self._receive_visualization(payload)
                case "connection":
                    self._receive_connection(decode(payload, ConnectionMessage))
                case "factsheet":
                    self._factsheet = decode(payload, Factsheet)
                case _:
                    self._note_other_version(payload)
        except MessageError as error:
            self._note_other_version(payload)
            self._invalid = f"its last message on {topic} was invalid: {text_of(error)}"
            self._log(f"invalid message: {topic}", text_of(error))
        return None

    def _receive_state(self, payload: bytes) -> VehicleState | None:
        state = decode(payload, State)
        expected = self.settings.version
        if state.version[:2] != expected[:2]:
            raise MessageError(f"its version is {text_of(state.version, 20)}, not {expected[0]}.x")
        if expected[0] == "1":  # its text has small letters in one place, and capitals in another
            for each in state.action_states:
                each.action_status = each.action_status.upper()
        if self._state is None and state.version.split(".")[:2] != expected.split(".")[:2]:
            version = text_of(state.version, 20)
            self._logger.warning(
                "%s: it speaks VDA 5050 %s, and the fleet's `version` is %s: write `version: %s`",
                *(self.resource, version, expected, version),
            )
        if state.serial_number != self.settings.serial_number:
            raise MessageError(f"it is of the vehicle {text_of(state.serial_number, 60)!r}")
        if self._is_late(state):
            return None
        self._state, self._state_us = state, self._clock.now_us()
        self._shown_s = seconds_of(state.timestamp)
        self._place = None if state.agv_position is UNSET else state.agv_position
        if state.velocity is not UNSET:
            self._velocity = state.velocity
        elif not state.driving:
            self._velocity = Velocity(vx=0.0, vy=0.0)
        else:
            self._velocity = None
        self._note_contact()
        self.step()
        return self.state()

    def _is_late(self, state: State) -> bool:
        """Whether a state is older than the last one: it was made and counted before it. A vehicle
        that restarts counts from 0 again, and its clock may have been set back: it has sent ONLINE,
        or sends nothing else."""
        last, may_be_older = self._state, self._may_be_older
        older, self._older, self._may_be_older = self._older, [], False
        made_s = seconds_of(state.timestamp)
        last_s = None if last is None else seconds_of(last.timestamp)
        if last is None or may_be_older or made_s is None or last_s is None or made_s >= last_s:
            return False
        if 0 < (state.header_id - last.header_id) % 2**32 < 2**31:
            return False
        older = [*older, made_s] if not older or made_s > older[-1] else [made_s]
        silent_s = (self._clock.now_us() - self._state_us) / 1e6
        if len(older) >= RESTARTED_STATES and silent_s >= RESTARTED_AFTER_S:
            return False
        self._older = older[-RESTARTED_STATES:]
        self._log("late state", f"it was made {last_s - made_s:.1f} s before the last one")
        return True

    def _receive_visualization(self, payload: bytes) -> VehicleState | None:
        message = decode(payload, Visualization)
        if message.agv_position is UNSET or self._state is None:
            return None
        if self._is_late_visualization(message):
            return None
        self._place = message.agv_position
        if message.velocity is not UNSET:
            self._velocity = message.velocity
        self._note_contact()
        return self.state()

    def _is_late_visualization(self, message: Visualization) -> bool:
        """Whether a visualization was made before the position that is known, or counted before
        the last one. One without a header is not."""
        made_s = None if message.timestamp is UNSET else seconds_of(message.timestamp)
        last_s, number, last = self._shown_s, message.header_id, self._shown_id
        if made_s is not None and last_s is not None and made_s != last_s:
            is_late = made_s < last_s
        elif isinstance(number, int) and isinstance(last, int):
            is_late = (number - last) % 2**32 >= 2**31
        else:
            is_late = False
        if is_late:
            self._log("late visualization", f"{number}, made at {text_of(message.timestamp, 40)}")
        else:
            self._shown_s, self._shown_id = made_s or last_s, number
        return is_late

    def _receive_connection(self, message: ConnectionMessage) -> None:
        match message.connection_state:
            case "ONLINE":
                self._broken_us, self._is_offline = None, False
                self._may_be_older, self._shown_id = True, UNSET
            case "OFFLINE":
                self._is_offline = True
            case _ if self._broken_us is None:
                self._broken_us = self._clock.now_us()

    def _note_other_version(self, payload: bytes) -> None:
        expected = self.settings.version
        version = text_of(other_version(payload, expected[:2]), 20)
        if not version or self._state is not None or self._other_version:
            return
        self._other_version = f"it speaks VDA 5050 {version}"
        if VERSIONS.fullmatch(version):
            said = f", and the fleet's `version` is {expected}: write `version: {version}`"
        else:
            said = (
                f": {SPOKEN}, reads no state and sends no order, action, zone or response of other "
                "versions; let it speak 2.1"
            )
        self._other_version += said
        self._logger.warning("%s: %s", self.resource, self._other_version)

    def _note_contact(self) -> None:
        self._contact_us = self._clock.now_us()
        self._has_contact, self._invalid = True, ""
        if self._broken_us is not None and self._contact_us > self._broken_us:
            self._broken_us = None  # its ONLINE is on the way: it has come back
        self._is_offline = False
        # Before the state is published: the executive stops a vehicle that it says is lost.
        self.link = LinkState.CONNECTED
        self.first_contact.set()

    # --- calls of the arbiter -------------------------------------------------------------------

    @property
    def doing(self) -> BehaviorId | None:
        """The behavior that goes on."""
        return None if self._task is None or self._task.over else self._task.request.id

    @property
    def order(self) -> str:
        """The order that the vehicle has, or had last; "" if it is not known."""
        return "" if self._state is None else self._state.order_id

    def listen(self) -> None:
        """The broker is connected: ask the vehicle for its state, which is not retained."""
        self._check.ask()
        if self._factsheet is None and self.settings.version[0] != "1":
            self._commander.control("factsheetRequest")

    def listen_from_now(self) -> None:
        """Count the silence of the vehicle from now on."""
        self._contact_us = self._clock.now_us()

    def refusal(self, request: BehaviorRequest) -> str:
        """Return why a request cannot be done now; "" if it can. A vehicle that was never received
        refuses nothing: its behavior will be LOST."""
        target = request.parameters.get("target")
        if target is not None and not isinstance(target, Point):
            return "target: a VDA 5050 vehicle drives to places, not after vehicles"
        if request.behavior == "reverse" and self.settings.version[0] == "1":
            return "VDA 5050 1.1 cannot say that a vehicle drives backwards"
        own = self._own.get(request.behavior)
        if own is not None and (reason := self._not_taken(own, request)):
            return reason
        state = self._state
        if state is None and self._other_version:
            return self._other_version
        if state is None or not self._has_contact:
            return ""
        if state.operating_mode not in COMMANDED:
            return f"its operating mode is {text_of(state.operating_mode, 30)}"
        if request.behavior in STOPS:
            return ""
        if self._check.problem:
            return self._check.problem
        if state.safety_state.e_stop != "NONE":
            return "its emergency stop is active"
        if fatal := fatal_errors(state):
            return f"it has a fatal error: {fatal}"
        if own is not None and own.scope is Scope.INSTANT:
            return ""
        if is_paused(state) and not self._is_paused_by_us():
            return "it is paused, and not by m2pem: let it go on where it was paused"
        known = {*self._left, self._id(request.id), *map(self._id, request.preempts)}
        if self._task is not None:
            known.add(self._task.id)
        if is_executing(state) and state.order_id not in known:
            return (
                f"it executes the order {text_of(state.order_id, 60)!r} of another master control"
            )
        return wrong_position(state, self.settings.map.id) or self._breach(request)

    def take(self, request: BehaviorRequest) -> None:
        """Begin a behavior. What the vehicle still does is cancelled first."""
        if self._task is not None and not self._task.over:
            self._leave_behind(self._task.id, cancel=True)
        self._left.pop(self._id(request.id), None)  # the vehicle may go on with it
        self._cancel_left()
        self._is_held = False
        if request.behavior not in STOPS and self._is_paused_by_us():
            self._pause.want(False)
        self._task = self._task_for(request)
        self.step()

    def adopt(self, request: BehaviorRequest) -> None:
        """Take up a behavior that the vehicle was found doing, after a restart."""
        self._task = self._task_for(request)
        self.step()

    def cancel(self, behavior: BehaviorId) -> None:
        if self._task is not None and self.doing == behavior:
            self._task.cancel()

    def hold(self) -> None:
        """Pause the vehicle. It keeps its order."""
        self._is_held = True
        self._pause.want(True)

    def resume(self) -> None:
        self._is_held = False
        if self._pause.wanted or self._state is None or is_paused(self._state):
            self._pause.want(False)

    @property
    def is_held(self) -> bool:
        """Whether the vehicle is paused, by whomever."""
        return self._state is not None and is_paused(self._state)

    async def obeyed(self) -> str:
        """Wait until a state shows that a pause or cancel was taken. Return "", or what is wrong,
        for operators."""
        try:
            async with asyncio.timeout(OBEYED_WITHIN_S):
                while late := [each for each in self._stops() if not each.is_taken(self._state)]:
                    self._news.clear()
                    await self._news.wait()
        except TimeoutError:
            why = "; ".join(each.refusal(self._state) for each in late)
            if self._broker_problem:
                why += f"; the broker is not connected: {self._broker_problem}"
            return f"{self.resource} does NOT obey: {why}"
        return ""

    def _stops(self) -> list[StopControl]:
        """Return the pause and the cancels of the vehicle."""
        stops = [self._pause, *(each for each in self._left.values() if each is not None)]
        if isinstance(self._task, OrderTask) and not self._task.over:
            stops.append(self._task.cancel_control)
        return stops

    def forget(self, behaviors: Collection[BehaviorId]) -> None:
        """Send nothing more for these behaviors: the vehicle goes on with what was released."""
        if self._task is not None and self._task.request.id in behaviors:
            self._task = None
            self._left.clear()
            self._pause.forget()  # another executive says now whether it is to be paused
        for behavior in behaviors:
            self._left.pop(self._id(behavior), None)

    async def reclaim(self) -> str:
        """End the orders that a lost vehicle may still execute, now that it is received again.
        Return "" when its state shows that they have ended; otherwise what it may still do."""
        if self.doing is not None:
            self._lose((self._clock.now_us() - self._contact_us) / 1e6)
        self._cancel_left()
        self.step()
        try:
            async with asyncio.timeout(RECLAIM_WITHIN_S):
                while self._left:
                    self._resolved.clear()
                    await self._resolved.wait()
        except TimeoutError:
            self.hold()
            return f"it has not ended its order {next(iter(self._left), '')!r}, and is paused"
        return ""

    async def known_state(self) -> State | None:
        """Return the last state; None: none arrives soon."""
        try:
            async with asyncio.timeout(QUERY_WITHIN_S):
                await self.first_contact.wait()
        except TimeoutError:
            return None
        return self._state

    def leave_behind(self, behavior: BehaviorId) -> None:
        """The vehicle may still execute the order of a behavior that is not known here."""
        self._leave_behind(self._id(behavior), cancel=False)

    @property
    def absence(self) -> str:
        """Where the vehicle is expected, and what was received from there, for people."""
        what = self._other_version or self._invalid or "no state was received"
        return f"{what}; it is expected at {self.settings.address}"

    # --- time -----------------------------------------------------------------------------------

    def attend(self, *, may_lose: bool, problem: str) -> VehicleState | None:
        """Look after the link and the task. Return the new state if the link has changed.

        `may_lose`: all messages until now were processed. `problem`: why the broker is not
        connected, or "".
        """
        silent_s = (self._clock.now_us() - self._contact_us) / 1e6
        before, self._broker_problem = self.link, problem
        said = self._disobedience
        self.link = self._link_state(silent_s, may_lose=may_lose)
        if self.link is LinkState.LOST and may_lose and self._is_silent(silent_s):
            if self.doing is not None:
                self._lose(silent_s, problem)
        elif self._state is not None:
            self.step()
        changed = self.link is not before or self._disobedience != said
        return self.state() if changed else None

    def step(self) -> None:
        """Send what is due, and report what the state shows."""
        state = self._state
        if state is None:
            return
        may_send = self._context.may_send()
        self._check.step(state, may_send=may_send)
        if self._check.is_answered:
            self.first_answer.set()
        self._pause.step(state, may_send=may_send)
        self._step_left(state, may_send=may_send)
        self._step_task(state)
        said = filter(None, (each.disobedience(state) for each in self._stops()))
        self._disobedience = next(said, "")
        self._news.set()

    def _step_task(self, state: State) -> None:
        task = self._task
        if task is None or task.over:
            return
        try:
            task.step(state)
        except Exception as error:
            self._logger.exception("%s: %s", self.resource, task.request.id)
            reason = f"internal error of m2pem: {type(error).__name__}: {error}"
            self._leave_behind(task.id, cancel=True)
            task.over = True
            self._tracker.end(task.request.id, BehaviorState.FAILED, reason=reason)

    def state(self) -> VehicleState:
        """Return the state of the vehicle for the fleet."""
        state, now_us = self._state, self._clock.now_us()
        behavior = ""
        if self._task is not None and not self._task.over:
            behavior = self._task.request.behavior
        if state is None:
            return VehicleState(self.resource, now_us, link=self.link, behavior=behavior)
        reasons = not_ready_reasons(state, self.settings.map.id, self._is_paused_by_us())
        if self._disobedience:
            reasons = (f"it does NOT obey: {self._disobedience}; use its own stop", *reasons)
        if not self._check.is_answered:
            waits = "it has not answered an instant action yet"
            reasons = (*reasons, self._check.problem or waits)
        if state.driving and not (is_executing(state) or behavior):
            reasons = (*reasons, "it drives, and has no order")
        if is_executing(state) and state.order_id not in self._known_orders():
            order = text_of(state.order_id, 60)
            reasons = (*reasons, f"it executes the order {order!r} of another master control")
        place = self._place
        return VehicleState(
            self.resource,
            now_us,
            self.position(),
            velocity_enu_m_s=self._velocity_enu(),
            yaw_rad=None if place is None else self._frame.to_yaw(place.theta),
            battery_fraction=min(1.0, max(0.0, state.battery_state.battery_charge / 100)),
            mode=text_of(state.operating_mode, 30),
            ready=not reasons,
            not_ready_reasons=reasons,
            link=self.link,
            behavior=behavior,
        )

    def position(self) -> GeoPosition | None:
        """Return the place of the vehicle; None: it is not known."""
        place = self._place
        if place is None or not place.position_initialized or place.map_id != self.settings.map.id:
            return None
        return self._frame.to_position(place.x, place.y)

    # --- inside ---------------------------------------------------------------------------------

    def _link_state(self, silent_s: float, *, may_lose: bool) -> LinkState:
        if not self._has_contact:
            return LinkState.LOST
        if self._is_silent(silent_s):
            return LinkState.LOST if may_lose else self.link
        if self._broken_us is not None or silent_s >= DEGRADED_SHARE * self._limits.lost_after_s:
            return LinkState.DEGRADED
        return LinkState.CONNECTED

    def _is_silent(self, silent_s: float) -> bool:
        bound_s = self._limits.lost_after_s
        if self._is_offline or silent_s >= bound_s:
            return True
        broken_us = self._broken_us
        if broken_us is None:
            return False
        return self._clock.now_us() - broken_us >= min(bound_s, BROKEN_AFTER_S) * 1e6

    def _lose(self, silent_s: float, problem: str = "") -> None:
        if self._task is not None:
            self._task.lost()
        reason = f"no message for {silent_s:.1f} s"
        if problem:
            reason += f", as the broker {self.settings.broker.url} is not connected: {problem}"
        elif self._is_offline:
            reason = "it has disconnected from the broker (OFFLINE)"
        elif self._broken_us is not None:
            reason = "its connection to the broker has broken (CONNECTIONBROKEN)"
        elif not self._has_contact or self._invalid:
            reason += f": {self.absence}"
        self._tracker.lose(self.resource, reason)

    def _step_left(self, state: State, *, may_send: bool) -> None:
        """Forget orders that have ended; cancel those that should not go on."""
        for order, cancel in list(self._left.items()):
            if self._state_us <= self._left_us:
                return  # the state is older
            has_ended = state.order_id != order or not (is_executing(state) or state.driving)
            if has_ended:
                del self._left[order]
                self._resolved.set()
            elif cancel is not None:
                cancel.step(state, may_send=may_send)

    def _leave_behind(self, order: str, cancel: bool) -> None:
        self._left.setdefault(order, None)
        self._left_us = self._clock.now_us()
        if cancel:
            self._cancel_left()

    def _cancel_left(self) -> None:
        """Cancel the orders that are left behind, once a state shows that they go on."""
        for order, cancel in self._left.items():
            if cancel is None:
                self._left[order] = CancelControl(self._commander, self._clock)

    def _known_orders(self) -> set[str]:
        task = set() if self._task is None else {self._task.id}
        return {*self._left, *task}

    def _is_paused_by_us(self) -> bool:
        state = self._state
        own = self._pause.wanted or self._pause.is_own
        return bool(own) or (state is not None and is_paused_by_us(state))

    def _id(self, behavior: BehaviorId) -> str:
        return order_id(self._context.journal, behavior)

    def _task_for(self, request: BehaviorRequest) -> Task:
        own = self._own.get(request.behavior)
        usual = {spec.name: spec for spec in USUAL}
        setup = TaskSetup(
            request,
            usual[request.behavior] if own is None else own.spec,
            self._id(request.id),
            self._context,
            self._tracker,
            self._commander,
            self._pause,
            self._limits.cancel_timeout_s,
            self._leave_behind,
            self.position,
            lambda: self._broker_problem,
            self._check,
        )
        if request.behavior in STOPS:
            return StopTask(setup, lambda: not self._is_held)
        if own is not None and own.scope is Scope.INSTANT:
            return InstantTask(setup, _action(own, setup.id, request.parameters))
        return OrderTask(setup, lambda state: self._plan(setup, own, state), self._progress_of)

    def _progress_of(self, plan: OrderPlan) -> OrderProgress:
        factsheet = self._factsheet or self.settings.factsheet
        most = None if factsheet is None else factsheet.most_nodes
        return OrderProgress(plan, self.settings.released_nodes, most)

    def _plan(
        self, setup: TaskSetup, own: OwnBehavior | None, state: State | None
    ) -> OrderPlan | None:
        """Return the plan of an order. `state`: where the vehicle is; None: it has the order
        already. Then None is returned if the parameters do not say all of it any more.

        Raises:
            ValueError: the place of the vehicle is not known.
        """
        request, settings = setup.request, self.settings
        start: MapPoint | None = None
        if state is not None:
            if wrong := wrong_position(state, settings.map.id):
                raise ValueError(f"the order cannot begin: {wrong}")
            assert state.agv_position is not UNSET
            start = MapPoint(state.agv_position.x, state.agv_position.y)
        points, loop = self._points(request, state)
        if points is None:
            return None
        parameters = BehaviorParameters(request.parameters)
        heading_rad, tolerance_m = parameters.heading_rad, parameters.tolerance_m
        actions = () if own is None else (_action(own, f"{setup.id}.action", request.parameters),)
        return OrderPlan(
            setup.id,
            settings.map.id,
            start,
            points,
            loop,
            parameters.speed_m_s,
            None if heading_rad is None else self._frame.to_theta(heading_rad),
            request.behavior == "reverse",
            settings.deviation_m,
            settings.deviation_m if tolerance_m is None else tolerance_m,
            settings.start_deviation_m,
            actions,
            self._headers.has_two_spellings,
        )

    def _points(
        self, request: BehaviorRequest, state: State | None
    ) -> tuple[tuple[MapPoint, ...] | None, bool]:
        """Return the waypoints, and whether they are a loop. None: they are not known."""
        parameters = BehaviorParameters(request.parameters)
        route, target = parameters.route, parameters.target
        if route is not None:
            points = tuple(self._frame.to_map(each[:2]) for each in route.waypoints)
            return points, parameters.loop
        if isinstance(target, Point):
            return (self._frame.to_map(target.position[:2]),), False
        if request.behavior == "reverse":
            if state is None or state.agv_position is UNSET:
                return None, False
            place, back_m = state.agv_position, parameters.distance_m
            x, y = back_m * math.cos(place.theta), back_m * math.sin(place.theta)
            return (MapPoint(place.x - x, place.y - y),), False
        is_whole = request.behavior in self._own and not any(
            each.required and each.kind is ParameterKind.ROUTE
            for each in self._own[request.behavior].spec.parameters
        )
        return (() if is_whole else None), False

    def _not_taken(self, own: OwnBehavior, request: BehaviorRequest) -> str:
        """Return why the vehicle would refuse an action, by its factsheet or by the version that
        it speaks; "" if it would not."""
        version = self.settings.version if self._state is None else self._state.version
        factsheet = self._factsheet or self.settings.factsheet
        values = _action_values(own, request.parameters)
        given = [key for key, value in values.items() if value != ""]
        return why_unsupported(own, version, factsheet) or lacking(own, given, version, factsheet)

    def _breach(self, request: BehaviorRequest) -> str:
        """Return where the request would leave the fence of the fleet; "" if it does not."""
        position = self.position()
        if position is None:
            return ""
        parameters = BehaviorParameters(request.parameters)
        behavior = request.behavior
        if parameters.route is not None:
            behavior = "single_vehicle_routing"
        elif isinstance(parameters.target, Point):
            behavior = "goto"
        yaw_rad = None if self._place is None else self._frame.to_yaw(self._place.theta)
        start, stance_of = position.latlon, stance_on(self._context.bus)
        found = find_breach(self._fence, behavior, parameters, start, yaw_rad, stance_of)
        return str(found or "")

    def _velocity_enu(self) -> tuple[float, float, float] | None:
        place, velocity = self._place, self._velocity
        if place is None or velocity is None:
            return None
        ahead = 0.0 if velocity.vx is UNSET else velocity.vx
        left = 0.0 if velocity.vy is UNSET else velocity.vy
        cos, sin = math.cos(place.theta), math.sin(place.theta)
        return (*self._frame.to_enu(ahead * cos - left * sin, ahead * sin + left * cos), 0.0)

    def _log(self, cause: str, detail: str) -> None:
        """Log a warning, one of each cause once in a while. `cause`: one of few texts."""
        now_us = self._clock.now_us()
        if now_us - self._logged_us.get(cause, -(10**18)) < LOG_AGAIN_AFTER_S * 1e6:
            self._unlogged[cause] += 1
            return
        self._logged_us[cause] = now_us
        more = self._unlogged.pop(cause, 0)
        since = f" ({more} more before)" if more else ""
        self._logger.warning("%s: %s: %s%s", self.resource, cause, detail, since)


def _action(own: OwnBehavior, action_id: str, parameters: Mapping[str, ResolvedValue]) -> Action:
    """Return the action of a behavior."""
    values = _action_values(own, parameters)
    return action_of(own.action, action_id, own.blocking, values)


def _action_values(own: OwnBehavior, parameters: Mapping[str, ResolvedValue]) -> dict[str, object]:
    """Return the parameters of an action, by their keys."""
    values: dict[str, object] = {}
    for spec in own.spec.parameters:
        value = parameters.get(spec.name, spec.default)
        if spec.name in DRIVING_PARAMETERS or value is None:
            continue
        is_count = spec.kind is ParameterKind.COUNT
        values[spec.name] = int(value) if is_count and isinstance(value, float) else value
    return values
