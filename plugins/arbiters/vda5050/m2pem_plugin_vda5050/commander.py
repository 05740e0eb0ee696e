"""Sends orders and instant actions to one vehicle, again until its state shows them."""

import uuid
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
from m2pem_plugin_vda5050.reading import ID_PREFIX, action_state, is_paused

RESEND_AFTER_S = 3.0
"""What a vehicle does not answer is sent again after this time: QoS 0 may lose messages. A vehicle
ignores an order that it has already (section 6.6.4.3)."""

Publish = Callable[[str, bytes, int], bool]


class Commander:
    """`publish`: sends a payload on a topic of the vehicle, given by its last level."""

    def __init__(self, headers: Headers, clock: Clock, publish: Publish) -> None:
        self._headers, self._clock, self._publish = headers, clock, publish

    def order(self, order_id: str, update_id: int, nodes: list[Node], edges: list[Edge]) -> None:
        header = self._headers.of("order", self._clock.now_us())
        message = Order(
            **header, order_id=order_id, order_update_id=update_id, nodes=nodes, edges=edges
        )
        self._publish("order", encode(message), QOS.get("order", 0))

    def instant(self, action: Action) -> None:
        header = self._headers.of("instantActions", self._clock.now_us())
        if self._headers.is_2_0:
            action.action_name = action.action_type
        message = InstantActions(**header, actions=[action])
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


class PauseControl:
    """Pauses a vehicle, and lets it go on: it sends until the state shows it."""

    def __init__(self, commander: Commander, clock: Clock) -> None:
        self._commander, self._repeater = commander, Repeater(clock)
        self._action_id = ""
        self.wanted: bool | None = None
        """Whether the vehicle should be paused; None: nothing is asked of it."""

    def want(self, paused: bool) -> None:
        """Pause the vehicle, or let it go on. Sent at once."""
        self.wanted = paused
        self._send()

    def step(self, state: State, *, may_send: bool) -> None:
        """Look at a state. `may_send`: whether to send again."""
        if self.wanted is None:
            return
        known = action_state(state, self._action_id)
        status = "" if known is None else known.action_status
        is_so = is_paused(state) == self.wanted
        if is_so and (status == "FINISHED" or self._repeater.is_due):
            self.wanted = None
        elif self._repeater.is_due and may_send:
            self._send()

    def _send(self) -> None:
        kind = "startPause" if self.wanted else "stopPause"
        self._action_id = self._commander.control(kind)
        self._repeater.sent()


class CancelControl:
    """Cancels the order of a vehicle: it sends until the state has the action."""

    def __init__(self, commander: Commander, clock: Clock) -> None:
        self._commander, self._repeater = commander, Repeater(clock)
        self._action_id = ""
        self.refused = False

    def send(self) -> None:
        """Send a new `cancelOrder`."""
        self._action_id = self._commander.control("cancelOrder")
        self._repeater.sent()

    def step(self, state: State, *, may_send: bool) -> str:
        """Look at a state of a vehicle that should end its order. Return the status of the action,
        "" if the vehicle does not have it. One that is lost, or has not had its effect, is sent
        again."""
        known = action_state(state, self._action_id) if self._action_id else None
        status = "" if known is None else known.action_status
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
