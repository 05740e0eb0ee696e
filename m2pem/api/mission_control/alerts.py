"""Operations on alerts and incidents."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from m2pem.api.alerts import OperatorAlert
from m2pem.api.runs import IncidentPreview, OpenIncident, RunId
from m2pem.mission.values import Value


class AlertControl(Protocol):
    """The operations of `MissionControl` on alerts and incidents."""

    async def incidents(self) -> Sequence[OpenIncident]:
        """The incidents of all runs that are open, in the order in which they opened."""

    async def preview_incident(
        self,
        run: RunId,
        incident: str,
        choice: str,
        *,
        data: Mapping[str, Value] | None = None,
        to: str = "",
        roles: Mapping[str, Sequence[str]] | None = None,
    ) -> IncidentPreview:
        """Whether the mission still completes after a choice about an incident.

        Arguments as for `resolve_incident`. It is explored in a process of its own; no run waits.
        """

    async def resolve_incident(
        self,
        run: RunId,
        incident: str,
        choice: str,
        *,
        data: Mapping[str, Value] | None = None,
        to: str = "",
        roles: Mapping[str, Sequence[str]] | None = None,
        by: str = "",
        even_if_stuck: bool = False,
    ) -> None:
        """Decide about an incident: one of its `choices`. The first one that ends it wins.

        `data`: what `set_data` writes. `to`: the element or sequence flow that `move` goes to.
        `roles`: who fills roles instead, by `retry_with`; a team means all of its members.
        `even_if_stuck`: an operator has confirmed a choice after which the mission cannot complete.

        Raises:
            OperatorError: the choice is wrong or comes too late, or others decide about it; the
                error says what would be right.
            StuckError: the mission cannot complete after it, and that was not confirmed.
        """

    async def alerts(self, *, over: bool = False) -> Sequence[OperatorAlert]:
        """What operators must know now (docs/operating.md): the alerts that are open, the most
        severe first, the newest of each severity first.

        `over`: then also the last ones that are over, the newest first.
        """

    async def acknowledge_alert(self, alert: str, *, by: str = "") -> None:
        """Note that an operator has seen an alert: it calls no operator any more. One that was said
        once, and is no condition that ends by itself, is over then.

        Raises:
            OperatorError: there is no such alert, it is over, or it is acknowledged already; or
                the journal has not written it within 1.5 s.
        """

    async def own_alert(self, alert: str, *, owner: str | None = None, by: str = "") -> None:
        """Note who takes care of an alert. None: `by` does; "": no operator any more.

        Raises:
            OperatorError: there is no such alert, or it is over; or the journal has not written it
                within 1.5 s.
        """
