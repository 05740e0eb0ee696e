"""What one behavior does on its vehicle: an order, an instant action, or a pause.

A task looks at each state of the vehicle (`step`), sends what is due, and reports to the tracker.
It never takes for granted that the vehicle does what it was sent: only a state says so.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from msgspec import UNSET

from m2pem.api import (
    ArbiterContext,
    BehaviorParameters,
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    BehaviorTracker,
    GeoPosition,
    RemainingRoute,
    Value,
)
from m2pem_plugin_vda5050.commander import (
    CancelControl,
    Commander,
    InstantActionCheck,
    PauseControl,
    Repeater,
)
from m2pem_plugin_vda5050.messages import Action, State
from m2pem_plugin_vda5050.orders import OrderPlan, OrderProgress
from m2pem_plugin_vda5050.reading import (
    COMMANDED,
    ENDED,
    action_state,
    base_end,
    describe,
    fatal_errors,
    is_executing,
    is_paused,
    said_about,
    text_of,
    traversed,
)

ACCEPTED_WITHIN_S = 15.0
"""A vehicle that has neither accepted nor refused an order or action by then has failed."""

CANCEL_SHARE = 0.8
"""A cancel that takes more than this part of the cancel timeout has failed."""

UNSENT_AFTER_S = 6.0
"""So long after a cancel, it has failed if the broker is not connected: operators must hear it."""

FATAL_FOR_S = 5.0
"""A vehicle that reports a FATAL error for so long has failed."""

LEAST_PROGRESS_M = 1.0
"""What is left of a route that fails or is lost is reported if so much was driven since."""

REFUSED = "REJECTED"


@dataclass(frozen=True, slots=True)
class TaskSetup:
    """The arguments of a task. `id`: of the order or action. `left_behind`: is called with the id
    of an order that the vehicle may still execute when its behavior has ended, and whether it is to
    be cancelled at once. `position`: the place of the vehicle. `broker_problem`: why the
    broker is not connected, or "". `check`: whether the vehicle takes instant actions."""

    request: BehaviorRequest
    spec: BehaviorSpec
    id: str
    context: ArbiterContext
    tracker: BehaviorTracker
    commander: Commander
    pause: PauseControl
    cancel_timeout_s: float
    left_behind: Callable[[str, bool], None]
    position: Callable[[], GeoPosition | None]
    broker_problem: Callable[[], str]
    check: InstantActionCheck


class Task(ABC):
    """One behavior on one vehicle."""

    def __init__(self, setup: TaskSetup) -> None:
        self._setup = setup
        self._clock = setup.context.clock
        self._since_us = self._clock.now_us()
        self.id = setup.id
        self.request = setup.request
        self.over = False

    @abstractmethod
    def step(self, state: State) -> None:
        """Look at a state of the vehicle, which may be one that was looked at before."""

    @abstractmethod
    def cancel(self) -> None:
        """End the behavior. Its end is reported when a state shows it."""

    def lost(self) -> None:
        """The link to the vehicle is lost: report what is left. The caller reports the loss."""
        self.over = True

    def _waited_s(self, since_us: int) -> float:
        return (self._clock.now_us() - since_us) / 1e6

    def _progress(self) -> None:
        self._setup.tracker.progress(self.request.id)

    def _end(
        self,
        state: BehaviorState,
        code: str = "",
        reason: str = "",
        outputs: dict[str, Value] | None = None,
    ) -> None:
        self.over = True
        if state is BehaviorState.SUCCEEDED:
            self._progress()  # a behavior that ends at once has run, too
        self._setup.tracker.end(self.request.id, state, code, reason, outputs)

    def _outputs(self, state: State, action_id: str) -> dict[str, Value]:
        """Return the result of an action under the name that its behavior writes."""
        known, writes = action_state(state, action_id), self._setup.spec.writes
        result = UNSET if known is None else known.result_description
        return {} if result is UNSET or not writes else {writes[0]: text_of(result, 10_000)}

    def _taken_over(self, state: State) -> bool:
        """Whether people have taken the vehicle, so that its behavior has ended."""
        if state.operating_mode in COMMANDED:
            return False
        mode = text_of(state.operating_mode, 30)
        self._end(BehaviorState.FAILED, "TAKEN_OVER", f"its operating mode is {mode} now")
        return True


class OrderTask(Task):
    """An order: nodes to drive to, and perhaps an action at the last one.

    `plan_from`: makes the plan of the order from where the vehicle is, or without that (None) for
    an order that it has already; it raises ValueError if the place of the vehicle is not known.
    """

    def __init__(
        self,
        setup: TaskSetup,
        plan_from: Callable[[State | None], OrderPlan | None],
        progress_of: Callable[[OrderPlan], OrderProgress],
    ) -> None:
        super().__init__(setup)
        self._plan_from, self._progress_of = plan_from, progress_of
        self._order: OrderProgress | None = None
        self._last: int | None = None
        self._actions: Sequence[Action] = ()
        self._repeater = Repeater(self._clock)
        self.cancel_control = CancelControl(setup.commander, self._clock)
        self._cancelled_us: int | None = None
        self._sent_us: int | None = None
        self._updated_us = self._since_us
        self._fatal_us: int | None = None
        self._has_begun = False
        self._old_errors: set[str] = set()
        self._route = RemainingRoute.of(setup.request.parameters)

    # --- calls of the vehicle -------------------------------------------------------------------

    def cancel(self) -> None:
        if self._sent_us is None and not self._has_begun:
            self._end(BehaviorState.CANCELLED)
            return
        if self._cancelled_us is None:
            self._cancelled_us = self._clock.now_us()
            self.cancel_control.send()

    def lost(self) -> None:
        self._report_left(LEAST_PROGRESS_M)
        self._leave(cancel=False)
        super().lost()

    def step(self, state: State) -> None:
        if state.order_id == self.id:
            self._step_begun(state)
        elif self._has_begun:
            other = text_of(state.order_id, 60)
            self._end(BehaviorState.FAILED, "TAKEN_OVER", f"it has another order now, {other!r}")
        elif self._cancelled_us is not None:
            self._step_cancelled_before(state, self._cancelled_us)
        elif self._sent_us is None:
            self._step_waiting(state)
        else:
            self._step_sent(state, self._sent_us)

    # --- before the vehicle has the order -------------------------------------------------------

    def _step_waiting(self, state: State) -> None:
        """The order is not sent while the vehicle executes another one, which is cancelled."""
        if self._taken_over(state):
            return
        if is_executing(state) or state.driving:
            if self._waited_s(self._since_us) > self._setup.cancel_timeout_s:
                other = text_of(state.order_id, 60)
                reason = f"the vehicle does not end its order {other!r}"
                self._end(BehaviorState.FAILED, "TIMEOUT", reason)
            return
        if problem := self._setup.check.problem:
            self._end(BehaviorState.FAILED, REFUSED, problem)
            return
        if not (self._setup.check.is_answered and self._setup.context.may_send()):
            return
        try:
            plan = self._plan_from(state)
        except ValueError as error:
            self._end(BehaviorState.FAILED, REFUSED, str(error))
            return
        assert plan is not None, "there is a plan for a request"
        self._old_errors = {describe(error) for error in state.errors}
        self._take_plan(plan)
        self._sent_us = self._clock.now_us()
        self._send_update()

    def _step_sent(self, state: State, sent_us: int) -> None:
        """Wait for the order to be accepted."""
        if refusal := self._refusal(state):
            self._end(BehaviorState.FAILED, REFUSED, f"the vehicle refuses the order: {refusal}")
        elif self._waited_s(sent_us) > ACCEPTED_WITHIN_S:
            self._leave(cancel=True)
            reason = f"the vehicle has not accepted the order within {ACCEPTED_WITHIN_S:g} s"
            self._end(BehaviorState.FAILED, "TIMEOUT", reason)
        elif not self._taken_over(state):
            self._repeat()

    def _step_cancelled_before(self, state: State, cancelled_us: int) -> None:
        """The order may still arrive, but before the cancel that was sent after it."""
        status = self.cancel_control.step(state, may_send=self._setup.context.may_send())
        if status in ENDED or self._refusal(state):
            self._end(BehaviorState.CANCELLED)
        else:
            self._fail_cancel_after_limit(cancelled_us)

    def _refusal(self, state: State) -> str:
        """Return the error with which the vehicle refuses the order; "" without one."""
        if said := said_about(state, self._ids()):
            return said[0]
        for error in state.errors:
            is_about_orders = error.error_type in ORDER_ERRORS and not error.error_references
            if is_about_orders and describe(error) not in self._old_errors:
                return describe(error)
        return ""

    # --- while the vehicle has the order --------------------------------------------------------

    def _step_begun(self, state: State) -> None:
        if not self._has_begun:
            self._has_begun = True
            if self._order is None:
                self._adopt(state)
        self._progress()
        if self._order is not None:
            self._order.reach(traversed(state))
        self._follow_route(traversed(state))
        if self._step_end(state):
            return
        if state.operating_mode not in COMMANDED:
            self._leave(cancel=False)
            self._report_left(LEAST_PROGRESS_M)
            self._taken_over(state)
        elif self._cancelled_us is not None:
            self.cancel_control.step(state, may_send=self._setup.context.may_send())
            if self.cancel_control.disobedience(state) and not self._setup.pause.wanted:
                self._setup.pause.want(True)  # it may obey that
            self._fail_cancel_after_limit(self._cancelled_us)
        elif fatal := fatal_errors(state):
            self._step_fatal(fatal)
        else:
            self._fatal_us = None
            self._step_updates(state)

    def _step_end(self, state: State) -> bool:
        """Whether the order has ended; that is reported."""
        if state.node_states or state.edge_states or state.driving or self._awaits_update(state):
            return False
        own = [action_state(state, action.action_id) for action in self._actions]
        if any(each is not None and each.action_status not in ENDED for each in own):
            return False
        is_there = self._last is not None and traversed(state) >= self._last
        if self._last is not None and self._order is not None:
            is_there = is_there and state.last_node_id == self._order.plan.node_id(self._last)
        statuses = ["" if each is None else each.action_status for each in own]
        if is_there and all(status == "FINISHED" for status in statuses):
            outputs = self._outputs(state, self._actions[0].action_id) if self._actions else {}
            self._end(BehaviorState.SUCCEEDED, outputs=outputs)
        elif self._cancelled_us is not None:
            self._report_left(LEAST_PROGRESS_M)
            self._end(BehaviorState.CANCELLED)
        elif "FAILED" in statuses:
            said = "; ".join(said_about(state, self._ids()))
            reason = said or f"the action {self._actions[0].action_type} has failed"
            self._end(BehaviorState.FAILED, reason=reason)
        elif is_there and self._actions:
            return False  # the vehicle has not entered its action yet
        else:
            self._report_left(LEAST_PROGRESS_M)
            mode = "" if state.operating_mode in COMMANDED else f" in mode {state.operating_mode}"
            node = f"{text_of(state.last_node_id, 60)!r}, {traversed(state)} of {self._last}"
            where = "" if self._last is None else f" at node {node}"
            reason = f"the order was ended on the vehicle{mode}{where}, not by m2pem"
            self._end(BehaviorState.FAILED, "TAKEN_OVER", reason)
        return True

    def _step_fatal(self, errors: str) -> None:
        """End the order of a vehicle that is not in running condition: it would go on later,
        when people have mended it."""
        if self._fatal_us is None:
            self._fatal_us = self._clock.now_us()
        elif self._waited_s(self._fatal_us) >= FATAL_FOR_S:
            self._leave(cancel=True)
            self._report_left(LEAST_PROGRESS_M)
            self._end(BehaviorState.FAILED, reason=f"the vehicle has a fatal error: {errors}")

    def _awaits_update(self, state: State) -> bool:
        """Whether the vehicle has done what was released, and soon gets more: it has no node left
        then, where m2pem has not sent what is not released."""
        order = self._order
        if order is None or not order.is_at_base_end(state.order_update_id, traversed(state)):
            return False
        if self._cancelled_us is not None and self.cancel_control.is_taken(state):
            return False
        has_all = state.order_update_id >= order.update_id
        return has_all or self._waited_s(self._updated_us) <= ACCEPTED_WITHIN_S

    def _step_updates(self, state: State) -> None:
        """Release more nodes, and send again what the vehicle does not have yet."""
        order = self._order
        if order is None or not self._setup.context.may_send():
            return
        if state.order_update_id < order.update_id:
            refusals = said_about(state, {self.id})
            if refusals and self._repeater.is_due:
                self._leave(cancel=True)
                self._report_left(LEAST_PROGRESS_M)
                reason = f"the vehicle refuses an update of its order: {'; '.join(refusals)}"
                self._end(BehaviorState.FAILED, "ROUTE_BLOCKED", reason)
            else:
                self._repeat()
        elif order.is_update_due:
            order.extend()
            self._updated_us = self._clock.now_us()
            self._send_update()

    def _fail_cancel_after_limit(self, cancelled_us: int) -> None:
        limit_s = CANCEL_SHARE * self._setup.cancel_timeout_s
        if problem := self._setup.broker_problem():
            limit_s = min(limit_s, UNSENT_AFTER_S)
        if self._waited_s(cancelled_us) < limit_s:
            return
        self._leave(cancel=True)
        self._setup.pause.want(True)
        self._report_left(LEAST_PROGRESS_M)
        did = "has refused the cancel" if self.cancel_control.refused else "did not stop"
        reason = f"the vehicle {did} within {limit_s:g} s, and may still execute its order"
        if problem:
            reason += f": the broker is not connected: {problem}"
        self._end(BehaviorState.FAILED, "TIMEOUT", reason)

    # --- inside ---------------------------------------------------------------------------------

    def _adopt(self, state: State) -> None:
        """Take up an order that was sent before a restart."""
        plan = self._plan_from(None)
        ends = [each.sequence_id for each in state.node_states]
        self._last = max([state.last_node_sequence_id, *ends]) // 2
        if plan is None:
            return
        self._take_plan(plan, extend=False)
        assert self._order is not None
        self._order.adopt(state.order_update_id, traversed(state), base_end(state))

    def _take_plan(self, plan: OrderPlan, *, extend: bool = True) -> None:
        self._order = self._progress_of(plan)
        self._last, self._actions = plan.last, plan.actions
        if extend:
            self._order.extend()

    def _ids(self) -> set[str]:
        return {self.id, *(action.action_id for action in self._actions)}

    def _repeat(self) -> None:
        if self._repeater.is_due and self._setup.context.may_send():
            self._send_update()

    def _send_update(self) -> None:
        assert self._order is not None, "only what has a plan is sent"
        self._setup.commander.order(self.id, self._order.update_id, *self._order.message())
        self._repeater.sent()

    def _leave(self, *, cancel: bool) -> None:
        if self._sent_us is not None or self._has_begun:
            self._setup.left_behind(self.id, cancel)

    def _follow_route(self, reached: int) -> None:
        route, position = self._route, self._setup.position()
        if route is None:
            return
        count = len(route.line.points)
        if 0 < reached <= count:
            route.reached(reached - 1)
        if position is not None and reached < count:
            route.moved(route.frame.to_local(position.latlon), reached)
        self._report_left()

    def _report_left(self, least_m: float | None = None) -> None:
        if self._route is not None and (left := self._route.to_report(least_m)) is not None:
            self._setup.tracker.remains(self.request.id, left)


ORDER_ERRORS = ("validationError", "orderError", "orderUpdateError", "noRouteError")


class InstantTask(Task):
    """An instant action. It cannot be cancelled: VDA 5050 has nothing for that."""

    def __init__(self, setup: TaskSetup, action: Action) -> None:
        super().__init__(setup)
        self._action = action
        self._repeater = Repeater(self._clock)
        self._has_begun = False

    def step(self, state: State) -> None:
        known = action_state(state, self.id)
        if known is None:
            self._step_sent(state)
            return
        self._has_begun = True
        self._progress()
        if known.action_status == "FINISHED":
            self._end(BehaviorState.SUCCEEDED, outputs=self._outputs(state, self.id))
        elif known.action_status == "FAILED":
            said = "; ".join(said_about(state, {self.id}))
            reason = said or f"the action {self._action.action_type} has failed"
            self._end(BehaviorState.FAILED, reason=reason)

    def cancel(self) -> None:
        """Nothing is sent: the executive waits for the end of the action."""

    def _step_sent(self, state: State) -> None:
        if said := said_about(state, {self.id}):
            self._end(BehaviorState.FAILED, REFUSED, f"the vehicle refuses it: {'; '.join(said)}")
        elif self._has_begun:
            self._end(BehaviorState.FAILED, reason="the vehicle has dropped the action")
        elif self._waited_s(self._since_us) > ACCEPTED_WITHIN_S:
            reason = f"the vehicle has not taken the action within {ACCEPTED_WITHIN_S:g} s"
            self._end(BehaviorState.FAILED, "TIMEOUT", reason)
        elif self._repeater.is_due and self._setup.context.may_send():
            self._setup.commander.instant(self._action)
            self._repeater.sent()


class StopTask(Task):
    """`hold` and `drive_stop`: the vehicle is paused until it is at rest, or for a duration.

    `drive_stop` leaves the vehicle paused; the next order lets it go on. `may_release`: whether
    no other client has asked for the vehicle to be held meanwhile.
    """

    def __init__(self, setup: TaskSetup, may_release: Callable[[], bool]) -> None:
        super().__init__(setup)
        self._duration_s = BehaviorParameters(setup.request.parameters).duration_s or 0.0
        self._may_release = may_release
        self._rests_since_us: int | None = None
        setup.pause.want(True)

    def step(self, state: State) -> None:
        if self._rests_since_us is None:
            if is_paused(state) and not state.driving:
                self._rests_since_us = self._clock.now_us()
            elif self._waited_s(self._since_us) > ACCEPTED_WITHIN_S:
                reason = f"the vehicle is not at rest within {ACCEPTED_WITHIN_S:g} s"
                self._end(BehaviorState.FAILED, "TIMEOUT", reason)
            return
        self._progress()
        if self._waited_s(self._rests_since_us) >= self._duration_s:
            self._release()
            self._end(BehaviorState.SUCCEEDED)

    def cancel(self) -> None:
        self._release()
        self._end(BehaviorState.CANCELLED)

    def _release(self) -> None:
        if self.request.behavior == "hold" and self._may_release():
            self._setup.pause.want(False)
