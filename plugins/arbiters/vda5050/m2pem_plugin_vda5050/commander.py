"""Sends orders and instant actions to one vehicle, again until its state shows them."""

import math
import uuid
from collections import deque
from collections.abc import Callable
from typing import Any

from msgspec import UNSET

from m2pem.api import Clock
from m2pem_plugin_vda5050.messages import (
    QOS,
    Action,
    ActionParameter,
    Edge,
    Headers,
    InstantActions,
    Node,
    Order,
    State,
    encode,
)
from m2pem_plugin_vda5050.reading import (
    ID_PREFIX,
    action_state,
    is_executing,
    is_paused,
    said_about,
    said_of_instant_actions,
)

RESEND_AFTER_S = 3.0
"""What a vehicle does not answer is sent again after this time: QoS 0 may lose messages. A vehicle
ignores an order that it has already (section 6.6.4.3)."""

ANSWERED_WITHIN_S = 1.0
"""A vehicle that obeys reports an instant action at once (section 6.9): after this time, operators
read that it does not. So long it may also contradict a stop that it reports as FINISHED."""

AT_REST_WITHIN_S = 6.0
"""So long a paused vehicle may brake."""

TAKES_NONE_AFTER_S = 7.0
"""A vehicle that has not answered any instant action in this time takes none."""

Publish = Callable[[str, bytes, int], bool]


class Commander:
    """`publish`: sends a payload on a topic of the vehicle, given by its last level."""

    def __init__(self, headers: Headers, clock: Clock, publish: Publish) -> None:
        self._headers, self._clock, self._publish = headers, clock, publish
        self.instant_ids: deque[str] = deque(maxlen=20)
        """The ids of the last instant actions."""

    def order(self, order_id: str, update_id: int, nodes: list[Node], edges: list[Edge]) -> None:
        header = self._headers.of("order", self._clock.now_us())
        message = Order(
            **header, order_id=order_id, order_update_id=update_id, nodes=nodes, edges=edges
        )
        self._publish("order", encode(message), QOS.get("order", 0))

    def instant(self, action: Action) -> None:
        header = self._headers.of("instantActions", self._clock.now_us())
        message = InstantActions(**header, actions=[action])
        if self._headers.has_two_spellings:
            action.action_name = action.action_type
            message.instant_actions = message.actions
        self.instant_ids.append(action.action_id)
        self._publish("instantActions", encode(message), QOS.get("instantActions", 0))

    def control(self, action_type: str) -> str:
        """Send an action that controls the vehicle. Return its id."""
        action_id = f"{ID_PREFIX}{action_type}-{uuid.uuid4().hex[:12]}"
        self.instant(Action(action_type=action_type, action_id=action_id, blocking_type="NONE"))
        return action_id


class Repeater:
    """When something is to be sent again."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._sent_us: int | None = None

    def sent(self) -> None:
        self._sent_us = self._clock.now_us()

    @property
    def is_due(self) -> bool:
        if self._sent_us is None:
            return True
        return self._clock.now_us() - self._sent_us >= RESEND_AFTER_S * 1e6


class InstantActionCheck:
    """Finds out whether a vehicle takes instant actions, by one that changes nothing. Without them,
    m2pem can neither stop nor pause it."""

    def __init__(self, commander: Commander, clock: Clock) -> None:
        self._commander, self._clock = commander, clock
        self._repeater = Repeater(clock)
        self._since_us: int | None = None
        self.is_answered = False
        self.problem = ""
        """Why the vehicle takes none; "": it does, or it is not known yet."""

    def ask(self) -> None:
        """Request a state, whose answer has the request as an action."""
        self._commander.control("stateRequest")
        self._repeater.sent()

    def step(self, state: State, *, may_send: bool) -> None:
        """Look at a state, and ask again without an answer."""
        if self.is_answered:
            return
        ids = set(self._commander.instant_ids)
        self.is_answered = bool(
            said_about(state, ids) or any(each.action_id in ids for each in state.action_states)
        )
        if self._since_us is None:
            self._since_us = self._clock.now_us()
        if self.is_answered:
            self.problem = ""
        elif self._clock.now_us() - self._since_us >= TAKES_NONE_AFTER_S * 1e6 and not self.problem:
            said = "; ".join(said_of_instant_actions(state))
            self.problem = (
                "it takes no instant actions, so that it could not be stopped: it has no "
                f"actionState of stateRequest{f', and says {said}' if said else ''}"
            )
        if not self.is_answered and self._repeater.is_due and may_send:
            self.ask()


class StopControl:
    """An instant action that stops a vehicle: it is sent until the state shows it."""

    kind = ""
    """The type of the action."""

    otherwise = ""
    """What a vehicle at rest is that has not taken it."""

    brakes_within_s = math.inf
    """So long the vehicle may go on after it has taken the action."""

    def __init__(self, commander: Commander, clock: Clock) -> None:
        self._commander, self._clock, self._repeater = commander, clock, Repeater(clock)
        self._action_id = ""
        self._since_us: int | None = None
        """When the vehicle was first commanded to stop; None: it is not."""
        self._finished_us: int | None = None

    def goes_on(self, state: State) -> bool:
        """Whether a vehicle does what the action is to end."""
        return is_executing(state) or state.driving

    def is_taken(self, state: State | None) -> bool:
        """Whether a state shows the action, or its effect, if it was sent."""
        if self._since_us is None:
            return True
        if state is None:
            return False
        return not self.goes_on(state) or self._status(state) not in ("", "FAILED")

    def disobedience(self, state: State) -> str:
        """Return what a state shows that is not as commanded; "" if the vehicle obeys, or may yet
        obey."""
        if self._since_us is None or not self.goes_on(state):
            return ""
        waited_s = self._waited_s(self._since_us)
        goes_on = "drives" if state.driving else self.otherwise
        if self._finished_us is not None:
            is_late = self._waited_s(self._finished_us) >= ANSWERED_WITHIN_S
            return f"it {goes_on} although it reports {self.kind} as FINISHED" if is_late else ""
        if not self.is_taken(state) and waited_s >= ANSWERED_WITHIN_S:
            return f"it {goes_on}, and {self.refusal(state)}"
        is_late = waited_s >= self.brakes_within_s
        return f"it {goes_on} {self.brakes_within_s:g} s after {self.kind}" if is_late else ""

    def refusal(self, state: State | None) -> str:
        """Return that the vehicle does not take the action, with what it says, for operators."""
        if state is None or not self._status(state):
            shows = f"no state shows {self.kind}"
        else:
            shows = f"has refused {self.kind}"
        said = "" if state is None else "; ".join(said_of_instant_actions(state))
        return f"{shows}: {said}" if said else shows

    def _status(self, state: State) -> str:
        """Return the status of the action, "" if the vehicle does not have it."""
        known = action_state(state, self._action_id) if self._action_id else None
        status = "" if known is None else known.action_status
        if status == "FINISHED" and self._finished_us is None:
            self._finished_us = self._clock.now_us()
        return status

    def _waited_s(self, since_us: int) -> float:
        return (self._clock.now_us() - since_us) / 1e6

    def _send(self, kind: str) -> None:
        self._action_id = self._commander.control(kind)
        self._repeater.sent()


class PauseControl(StopControl):
    """Pauses a vehicle, and lets it go on."""

    kind, otherwise = "startPause", "is not paused"
    brakes_within_s = AT_REST_WITHIN_S

    def __init__(self, commander: Commander, clock: Clock) -> None:
        super().__init__(commander, clock)
        self.wanted: bool | None = None
        """Whether the vehicle should be paused; None: nothing is asked of it."""
        self.is_own = False
        """Whether it was paused so. Some vehicles do not report the action for long."""

    def want(self, paused: bool) -> None:
        """Pause the vehicle, or let it go on. Sent at once."""
        self.forget()
        self.wanted = paused
        self._since_us = self._clock.now_us() if paused else None
        self._send("startPause" if paused else "stopPause")

    def forget(self) -> None:
        """Ask nothing more of the vehicle."""
        self.wanted = self._since_us = self._finished_us = None

    def goes_on(self, state: State) -> bool:
        return not is_paused(state) or state.driving

    def step(self, state: State, *, may_send: bool) -> None:
        """Look at a state. `may_send`: whether to send again."""
        paused = is_paused(state)
        self.is_own = paused and (self.is_own or self.wanted is True)
        if self.wanted is None:
            return
        status = self._status(state)
        if paused == self.wanted:
            is_done = status == "FINISHED" or self._repeater.is_due
            if is_done and not (paused and state.driving):
                self.forget()
        elif self._repeater.is_due and may_send:
            self._send("startPause" if self.wanted else "stopPause")


class CancelControl(StopControl):
    """Cancels the order of a vehicle."""

    kind, otherwise = "cancelOrder", "has its order"
    refused = False

    def send(self) -> None:
        """Send a new `cancelOrder`."""
        if self._since_us is None:
            self._since_us = self._clock.now_us()
        self._send(self.kind)

    def step(self, state: State, *, may_send: bool) -> str:
        """Look at a state of a vehicle that should end its order. Return the status of the action,
        "" if the vehicle does not have it. One that is lost, or has not had its effect, is sent
        again."""
        status = self._status(state)
        self.refused = self.refused or status == "FAILED"
        if status in ("", "FAILED", "FINISHED") and self._repeater.is_due and may_send:
            self.send()
        return status


def action_of(action_type: str, action_id: str, blocking: Any, values: dict[str, Any]) -> Action:
    """Return an action of an order, or an instant action."""
    parameters = [ActionParameter(key=key, value=value) for key, value in values.items()]
    return Action(
        action_type=action_type,
        action_id=action_id,
        blocking_type=blocking,
        action_parameters=parameters or UNSET,
    )
