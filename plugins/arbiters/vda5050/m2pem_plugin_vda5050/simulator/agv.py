"""A simulated vehicle: what it makes of orders and instant actions, and its state.

It follows VDA 5050 2.1: orders are validated, refused with errors, executed node by node; see
section 6.6. It knows no broker: `receive` takes messages, `state` makes them.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from msgspec import UNSET

from m2pem_plugin_vda5050.map_frame import MapPoint
from m2pem_plugin_vda5050.messages import (
    Action,
    ActionState,
    AgvPosition,
    BatteryState,
    Edge,
    EdgeState,
    Error,
    ErrorReference,
    Headers,
    InstantActions,
    MessageError,
    Node,
    NodeState,
    Order,
    SafetyState,
    State,
    Velocity,
    Visualization,
    decode,
)
from m2pem_plugin_vda5050.simulator.motion import Chassis, Leg, Motion
from m2pem_plugin_vda5050.simulator.order_check import OrderError, check_doable, check_shape

USED_PER_M = 2e-5
"""Of the battery, as a fraction."""

ACTION_S = 3.0
NODE_ACTIONS = (
    *("pick", "drop", "startCharging", "stopCharging", "detectObject", "finePositioning"),
    "waitForTrigger",
)
"""The actions of every simulated vehicle on nodes; the fleet may declare more."""

INSTANT_ACTIONS = (
    *("startPause", "stopPause", "cancelOrder", "stateRequest", "factsheetRequest"),
    *("initPosition", "logReport"),
)


@dataclass(frozen=True, slots=True)
class AgvSpec:
    """A simulated vehicle. `actions`: how long its actions of nodes take, in seconds, by type.
    `stops_at_nodes`: after a cancel, it drives on to the next node."""

    name: str
    manufacturer: str
    serial_number: str
    version: str
    map_id: str
    x: float = 0.0
    y: float = 0.0
    theta_rad: float = 0.0
    chassis: Chassis = field(default_factory=Chassis)
    battery: float = 1.0
    actions: Mapping[str, float] = field(default_factory=dict)
    stops_at_nodes: bool = False


@dataclass(slots=True)
class _Running:
    """An action that goes on."""

    action: Action
    left_s: float
    state: ActionState


class Agv:
    """One vehicle. `say`: prints a line. `news`: a state is to be sent soon."""

    def __init__(self, spec: AgvSpec, say: Callable[[str], object]) -> None:
        self.spec = spec
        self.motion = Motion(spec.chassis, spec.x, spec.y, spec.theta_rad)
        self.news = True
        self.wants_factsheet = True
        self.mode = "AUTOMATIC"
        self.e_stop = "NONE"
        self.localized = True
        self.battery = spec.battery
        self.refuses_cancel = False
        self.refuses_orders = ""
        self.fails_actions = False
        self.fatal = ""
        self._say = say
        self._order_id, self._update_id = "", 0
        self._last_node_id, self._last_sequence = "", 0
        self._nodes: list[Node] = []
        self._edges: list[Edge] = []
        self._waiting: list[tuple[int, Action]] = []
        self._running: list[_Running] = []
        self._actions: dict[str, ActionState] = {}
        self._errors: list[Error] = []
        self._action_errors: list[Error] = []
        self._cancel: ActionState | None = None
        self._cancel_at = 0
        self._pause: ActionState | None = None
        self._paused = False
        self._charging = False
        self._loads: list[dict[str, Any]] = []
        self._drove = False

    # --- messages -------------------------------------------------------------------------------

    def receive(self, topic: str, payload: bytes) -> None:
        """Process an order or instant actions. Anything else is refused with an error."""
        self.news = True
        try:
            if topic == "order":
                self._receive_order(decode(payload, Order))
            else:
                self._receive_instant(decode(payload, InstantActions))
        except MessageError as error:
            self._say(f"{self.spec.name}: refuses a message on {topic}: {error}")
            self._errors = [_error("validationError", str(error), topic=topic)]

    def state(self, headers: Headers, time_us: int) -> State:
        """Return the state message."""
        self.news = False
        order_states = list(self._actions.values())
        errors = [*self._errors, *self._action_errors]
        if self.fatal:
            errors.append(_error("fatal", self.fatal, level="FATAL"))
        return State(
            **headers.of("state", time_us),
            order_id=self._order_id,
            order_update_id=self._update_id,
            last_node_id=self._last_node_id,
            last_node_sequence_id=self._last_sequence,
            driving=self.motion.moves,
            paused=self._paused,
            new_base_request=self._base_runs_low(),
            operating_mode=self.mode,
            node_states=[
                NodeState(each.node_id, each.sequence_id, each.released) for each in self._nodes
            ],
            edge_states=[
                EdgeState(each.edge_id, each.sequence_id, each.released) for each in self._edges
            ],
            action_states=order_states,
            agv_position=self._position(),
            velocity=self._velocity(),
            battery_state=BatteryState(round(100 * self.battery, 2), self._charging),
            errors=errors,
            safety_state=SafetyState(self.e_stop, False),
            loads=list(self._loads),
        )

    def visualization(self) -> Visualization:
        return Visualization(self._position(), self._velocity())

    # --- faults ---------------------------------------------------------------------------------

    def set_mode(self, mode: str) -> None:
        """Change the operating mode. Without the master control, all orders are cleared."""
        self.mode = mode
        if mode not in ("AUTOMATIC", "SEMIAUTOMATIC"):
            self._clear_order()
        self.news = True

    def set(self, name: str, value: object) -> None:
        """Set an attribute that a fault changes."""
        setattr(self, name, value)
        self.news = True

    # --- orders ---------------------------------------------------------------------------------

    def _receive_order(self, order: Order) -> None:
        if order.order_id == self._order_id and order.order_update_id == self._update_id:
            return  # the vehicle has it (6.6.4.3)
        try:
            self._check(order)
        except OrderError as error:
            self._say(f"{self.spec.name}: refuses order {order.order_id}: {error.type}: {error}")
            about = {
                "orderId": order.order_id,
                "orderUpdateId": str(order.order_update_id),
                **error.about,
            }
            self._errors = [_error(error.type, str(error), **about)]
            return
        self._errors = []
        if order.order_id == self._order_id:
            self._say(f"{self.spec.name}: accepts update {order.order_update_id}")
            self._nodes = [each for each in self._nodes if each.released]
            self._edges = [each for each in self._edges if each.released]
            new_nodes = order.nodes[1:]
        else:
            self._say(f"{self.spec.name}: accepts order {order.order_id}")
            kept = {each.state.action_id for each in self._running}
            self._actions = {key: each for key, each in self._actions.items() if key in kept}
            self._action_errors = []
            self._nodes, self._edges, self._waiting = [], [], []
            new_nodes = order.nodes
        self._order_id, self._update_id = order.order_id, order.order_update_id
        known = {each.sequence_id for each in self._nodes}
        self._nodes += [each for each in new_nodes if each.sequence_id not in known]
        self._edges += order.edges
        waiting = {action.action_id for _, action in self._waiting}
        for node in new_nodes:
            for action in node.actions:
                if action.action_id not in waiting:
                    self._waiting.append((node.sequence_id, action))
                    self._actions[action.action_id] = ActionState(
                        action.action_id, "WAITING", action.action_type
                    )
        if new_nodes is order.nodes:
            self._traverse()

    def _check(self, order: Order) -> None:
        """Check an order as the standard's figure 8 does.

        Raises:
            OrderError: it is refused.
        """
        check_shape(order)
        if order.manufacturer != self.spec.manufacturer:
            raise OrderError("validationError", f"manufacturer is {order.manufacturer!r}")
        if order.serial_number != self.spec.serial_number:
            raise OrderError("validationError", f"serialNumber is {order.serial_number!r}")
        if self.mode not in ("AUTOMATIC", "SEMIAUTOMATIC"):
            raise OrderError("orderError", f"the operating mode is {self.mode}")
        if self.refuses_orders:
            raise OrderError("orderError", self.refuses_orders)
        known = {*self.spec.actions}
        check_doable(order, {self.spec.map_id}, known)
        first = order.nodes[0]
        if order.order_id != self._order_id:
            if self._is_executing():
                raise OrderError("orderError", f"the order {self._order_id} is not done yet")
            position = first.node_position
            assert position is not UNSET, "it was checked"
            deviation = position.allowed_deviation_x_y
            near_m = 0.2 if deviation is UNSET else max(0.2, deviation)
            away_m = self.motion.distance_m(MapPoint(position.x, position.y))
            if away_m > near_m:
                problem = f"the first node is {away_m:.1f} m away"
                raise OrderError("noRouteError", problem, nodeId=first.node_id)
            return
        if order.order_update_id < self._update_id:
            problem = f"orderUpdateId {order.order_update_id} is below {self._update_id}"
            raise OrderError("orderUpdateError", problem)
        base = [each for each in self._nodes if each.released]
        end = (
            (base[-1].node_id, base[-1].sequence_id)
            if base
            else (self._last_node_id, self._last_sequence)
        )
        if (first.node_id, first.sequence_id) != end:
            problem = f"the update begins at {first.node_id}, and the base ends at {end[0]}"
            raise OrderError("orderUpdateError", problem, nodeId=first.node_id)

    def _is_executing(self) -> bool:
        return bool(self._nodes or self._edges or self._running or self._waiting)

    def _base_runs_low(self) -> bool:
        base = [each for each in self._nodes if each.released]
        return len(base) <= 1 and len(base) < len(self._nodes)

    def _traverse(self) -> None:
        """The first node is reached: trigger its actions."""
        node = self._nodes.pop(0)
        self._edges = [each for each in self._edges if each.sequence_id > node.sequence_id]
        self._last_node_id, self._last_sequence = node.node_id, node.sequence_id
        self.news = True

    def _clear_order(self) -> None:
        """Drop the order. Its actions have failed; `orderId` is kept."""
        self._nodes, self._edges = [], []
        for _, action in self._waiting:
            self._set_action(self._actions[action.action_id], "FAILED")
        for running in self._running:
            self._set_action(running.state, "FAILED")
        self._waiting, self._running = [], []
        self.news = True

    # --- instant actions ------------------------------------------------------------------------

    def _receive_instant(self, message: InstantActions) -> None:
        for action in message.actions:
            if action.action_id in self._actions:
                continue
            state = ActionState(action.action_id, "RUNNING", action.action_type)
            self._actions[action.action_id] = state
            self._do_instant(action, state)

    def _do_instant(self, action: Action, state: ActionState) -> None:
        match action.action_type:
            case "startPause":
                self._paused, self._pause = True, state
            case "stopPause":
                self._paused, self._pause = False, None
                self._set_action(state, "FINISHED")
            case "cancelOrder" if self.refuses_cancel:
                self._fail(state, "cancelError", "the vehicle cannot cancel now")
            case "cancelOrder" if not self._is_executing():
                self._fail(state, "noOrderToCancel", "there is no order")
            case "cancelOrder":
                base = [each.sequence_id for each in self._nodes if each.released]
                self._cancel = state
                self._cancel_at = base[0] if base and self.spec.stops_at_nodes else 0
            case "stateRequest" | "logReport":
                self._set_action(state, "FINISHED")
            case "factsheetRequest":
                self.wants_factsheet = True
                self._set_action(state, "FINISHED")
            case "initPosition":
                self._init_position(action, state)
            case _:
                problem = f"there is no instant action {action.action_type!r}"
                self._fail(state, "instantActionError", problem)

    def _init_position(self, action: Action, state: ActionState) -> None:
        values = _parameters(action)
        try:
            x, y, theta = (float(values[key]) for key in ("x", "y", "theta"))
        except (KeyError, TypeError, ValueError):
            self._fail(state, "instantActionError", "initPosition needs x, y and theta")
            return
        self.motion.x, self.motion.y, self.motion.theta_rad = x, y, theta
        self._last_node_id = str(values.get("lastNodeId", self._last_node_id))
        self.localized = True
        self._set_action(state, "FINISHED")

    # --- time -----------------------------------------------------------------------------------

    def step(self, dt_s: float) -> None:
        """Advance by `dt_s` simulated seconds."""
        self._step_actions(dt_s)
        self._step_motion(dt_s)
        if self._pause is not None and not self.motion.moves:
            self._set_action(self._pause, "FINISHED")
            self._pause = None
        if self._cancel is not None and not self.motion.moves and self._stops_now:
            self._clear_order()
            self._set_action(self._cancel, "FINISHED")
            self._cancel = None
        self.battery = max(0.0, self.battery - USED_PER_M * abs(self.motion.speed_m_s) * dt_s)
        if self._drove != self.motion.moves:
            self._drove = self.motion.moves
            self.news = True

    def _step_motion(self, dt_s: float) -> None:
        legs = self._legs()
        blocked = any(each.action.blocking_type != "NONE" for each in self._running)
        halts = self._paused or blocked or not self.localized or self.e_stop != "NONE"
        if not legs or halts or self._stops_now or self.fatal:
            self.motion.stop(dt_s)
            return
        if self._cancel is not None:
            legs = legs[:1]
        if not self.motion.drive(legs, dt_s):
            return
        position = self._nodes[0].node_position
        theta = UNSET if position is UNSET else position.theta
        if theta is not UNSET and not self.motion.turn_to(theta, dt_s):
            return
        self._traverse()

    @property
    def _stops_now(self) -> bool:
        """Whether the order is cancelled, and the vehicle is where it may stop."""
        return self._cancel is not None and self._last_sequence >= self._cancel_at

    def _legs(self) -> list[Leg]:
        """Return the way along the released nodes."""
        edges = {each.sequence_id: each for each in self._edges}
        legs = []
        for node in self._nodes:
            if not node.released:
                break
            position, edge = node.node_position, edges.get(node.sequence_id - 1)
            assert position is not UNSET, "it was checked"
            limit = math.inf if edge is None or edge.max_speed is UNSET else edge.max_speed
            orientation = UNSET if edge is None else edge.orientation
            backwards = orientation is not UNSET and abs(orientation) > math.pi / 2
            legs.append(Leg(MapPoint(position.x, position.y), limit, backwards))
        return legs

    def _step_actions(self, dt_s: float) -> None:
        """Go on with actions, and begin those of nodes that were traversed, one after the other."""
        for running in list(self._running):
            running.left_s -= dt_s
            if running.left_s <= 0:
                self._running.remove(running)
                self._finish(running)
        if self._running or not self._waiting or self._paused:
            return
        sequence, action = self._waiting[0]
        if sequence <= self._last_sequence and not any(
            each.sequence_id <= sequence for each in self._nodes
        ):
            self._waiting.pop(0)
            state = self._actions[action.action_id]
            self._set_action(state, "RUNNING")
            duration_s = self.spec.actions.get(action.action_type, ACTION_S)
            self._running.append(_Running(action, duration_s, state))

    def _finish(self, running: _Running) -> None:
        action, state = running.action, running.state
        if self.fails_actions:
            self._fail(state, f"{action.action_type}Error", "the station is not there")
            return
        values = _parameters(action)
        match action.action_type:
            case "pick":
                known = ("loadId", "loadType")
                self._loads.append({key: values[key] for key in values if key in known})
            case "drop" if not self._loads:
                self._fail(state, "dropError", "there is no load to put down")
                return
            case "drop":
                self._loads.pop()
            case "startCharging":
                self._charging = True
            case "stopCharging":
                self._charging = False
        state.result_description = f"{action.action_type} done"
        self._say(f"{self.spec.name}: has done {action.action_type}")
        self._set_action(state, "FINISHED")

    # --- inside ---------------------------------------------------------------------------------

    def _set_action(self, state: ActionState, status: str) -> None:
        state.action_status = status
        self.news = True

    def _fail(self, state: ActionState, type_: str, problem: str) -> None:
        self._action_errors = [
            *self._action_errors[-9:],
            _error(type_, problem, actionId=state.action_id),
        ]
        self._set_action(state, "FAILED")

    def _position(self) -> AgvPosition:
        motion = self.motion
        return AgvPosition(
            round(motion.x, 4),
            round(motion.y, 4),
            round(motion.theta_rad, 5),
            self.spec.map_id,
            self.localized,
        )

    def _velocity(self) -> Velocity:
        motion = self.motion
        return Velocity(round(motion.speed_m_s, 4), 0.0, round(motion.yaw_rate_rad_s, 4))


def _parameters(action: Action) -> dict[str, Any]:
    given = action.action_parameters
    return {} if given is UNSET else {each.key: each.value for each in given}


def _error(type_: str, problem: str, level: str = "WARNING", **about: str) -> Error:
    references = [ErrorReference(key, value) for key, value in about.items()]
    return Error(type_, level, references, problem)
