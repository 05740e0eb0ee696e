"""Vehicles and payloads go back to the missions: given by who has them, or by others.

A vehicle that goes back may move. So no operator gives back behind the back of the one who flies
it; and none stays with an operator who is gone. Another operator gives a reason, which the journal
and all operators get, and must be a supervisor of the fleet, or the one who has it must be gone, or
must have left a request for it unanswered.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from m2pem.api.alerts import AlertSeverity
from m2pem.api.runs import CONTROL_FORCED, Alert
from m2pem.errors import OperatorError
from m2pem.executive.control_requests import ControlRequests
from m2pem.executive.handover import UNNAMED_OPERATOR, Handover
from m2pem.executive.presence import Presence
from m2pem.executive.runner import Runner
from m2pem.fleet.approval import person_of
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.operator_roles import why_not_allowed


@dataclass(eq=False)
class ControlRelease:
    """Implements `MissionControl.give_back`. `publish`: tells operators."""

    _fleet: Fleet
    _handover: Handover
    _requests: ControlRequests
    _presence: Presence
    _publish: Callable[[Alert], None]

    async def give_back(self, name: str, by: str, reason: str, runners: Iterable[Runner]) -> None:
        """Give a resource back to the missions. `reason`: of an operator who does not have it.

        Raises:
            OperatorError: no operator has it, or `by` may not give it back.
        """
        resource = self._handover.known(name)
        by, reason = by or UNNAMED_OPERATOR, reason.strip()
        holder = self._handover.taken.get(resource)
        if holder is None:
            raise OperatorError(f"{resource} is not with an operator")
        own = person_of(holder) == person_of(by)
        if not own:
            self._refuse_unless_allowed(resource, holder, by, reason)
            text = f"{by} has given {resource} back to the missions, which {holder} had: {reason}"
            self._publish(Alert("", CONTROL_FORCED, text, AlertSeverity.WARNING, (resource,)))
        forced = ("", "") if own else (holder, reason)
        try:
            await self._handover.give_back(resource, by, runners, *forced)
        finally:  # also if the journal of a run did not take it
            await self._requests.returned(resource, by)

    def _refuse_unless_allowed(self, resource: str, holder: str, by: str, reason: str) -> None:
        """Check that an operator may give back what another one has.

        Raises:
            OperatorError: the operator may not.
        """
        fleet = self._fleet
        has = f"{resource} is with {holder}, who gives it back"
        if by == UNNAMED_OPERATOR:
            raise OperatorError(f"{has}; another operator needs a name to do it")
        is_supervisor = bool(fleet.supervisor_role) and not why_not_allowed(
            fleet, fleet.supervisor_role, by
        )
        gone_s, limit_s = self._presence.gone_s(holder), fleet.control_gone_after_s
        is_gone = gone_s >= limit_s
        unanswered = not fleet.supervisor_role and self._requests.left_unanswered(resource)
        if not (is_supervisor or is_gone or unanswered):
            others = f"when {holder} is at no page or terminal for {limit_s:g} s"
            if gone_s:
                others += f" (now: {gone_s:.0f} s)"
            if fleet.supervisor_role:
                others += f", or as {fleet.supervisor_role}"
            else:
                others += ", or leaves a request for it unanswered"
            raise OperatorError(f"{has}. Ask for it; another operator gives it back only {others}")
        if not reason:
            where = f"{_gone(holder, gone_s)}: " if is_gone else ""
            raise OperatorError(f"{has}. {where}say why you give it back; all operators see it")


def _gone(holder: str, gone_s: float) -> str:
    if math.isinf(gone_s):  # one who gave no name, or of very many the one seen the longest ago
        return "it is not known when this operator was last at a page or terminal"
    return f"{holder} is at no page or terminal for {gone_s:.0f} s"
