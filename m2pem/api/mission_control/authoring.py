"""Operations on missions that are written: check, verify, rehearse, estimate and approve them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

from m2pem.api.approval import MissionApproval
from m2pem.api.authoring import (
    DEFAULT_LIMITS,
    Draft,
    Editable,
    MissionSource,
    Outline,
    SearchLimits,
    SearchProgress,
)
from m2pem.api.estimates import MissionEstimate
from m2pem.api.runs import SimulationResult
from m2pem.findings import Finding
from m2pem.mission.values import Value


class AuthoringControl(Protocol):
    """The operations of `MissionControl` on missions that are written."""

    def check(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> Sequence[Finding]:
        """All findings of `m2pem check` for a mission and the fleet in use.

        `data`: names that are given at start.
        """

    def estimate(self, mission: MissionSource, *, process: str | None = None) -> MissionEstimate:
        """What a mission takes as it is drawn: distance, time and battery of each vehicle.

        Raises:
            FindingsError: the mission cannot be read, has no such process, or a vehicle of the
                fleet cannot be simulated.
            OperatorError: this executive cannot estimate missions.
        """

    async def simulate(self, mission: MissionSource, **options: Any) -> SimulationResult:
        """Rehearse a mission with this fleet on a virtual clock. Cancelling ends it.

        Options: `process`, `data`, `spec` (the text of a file of requirements, as bytes),
        `answers` (path of an answers file, or its text as bytes), `start_us` (microseconds since
        the Unix epoch), `max_steps` (100,000: all records are kept in memory), `telemetry_every_s`
        (None: the result has no telemetry).

        Raises:
            FindingsError: the mission, the requirements or the answers cannot be used.
        """

    async def verify(
        self,
        mission: MissionSource,
        *,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        spec: str | None = None,
        strict: bool = False,
        timers_in_order: bool = False,
        assume: Sequence[str] = (),
        all_pools: bool = False,
        limits: SearchLimits = DEFAULT_LIMITS,
        on_progress: Callable[[SearchProgress], None] | None = None,
    ) -> Mapping[str, Any]:
        """Verify a mission with this fleet, as `m2pem verify --format json` does.

        `spec`: the text of a file of requirements. `timers_in_order`: `--timers in-order`.
        `assume`: each as one `--assume`; `all_pools`: `--all-pools`. It takes a processor for up to
        `limits.seconds`, and is done in a process of its own; cancelling ends that. The answer has
        the shape of docs/verification.schema.json.

        Raises:
            FindingsError: the mission or the requirements cannot be used.
        """

    def editable(self, mission: bytes, *, anew: bool = False) -> Editable:
        """The same mission as an editor takes it, with a diagram of everything in it.

        `anew`: what it has of diagrams is laid out again.

        Raises:
            MissionError: it is no BPMN 2.0.
        """

    def outline(self, mission: bytes | Draft) -> Outline:
        """What a file has, also one with errors, as far as it can be read.

        Raises:
            MissionError: it is no BPMN 2.0.
        """

    def services(self) -> Mapping[str, Sequence[str]]:
        """The service-task classes that there are, with the names of data that each writes."""

    async def approval(self, mission: MissionSource) -> MissionApproval:
        """Who has approved a mission, and who must before it may start (docs/approval.md).

        Raises:
            MissionError: it cannot be read.
        """

    async def approve(
        self, mission: MissionSource, *, digest: str = "", by: str = ""
    ) -> MissionApproval:
        """Approve exactly this content of a mission: its file, those that it calls or imports, and
        the routes, areas and points that they name. Returns its approvals then. `digest`: of the
        content that `by` has looked at; another one is not approved.

        Raises:
            MissionError: it cannot be read.
            OperatorError: the fleet asks for no approvals, or `by` may not approve this mission.
        """

    async def withdraw_approval(self, mission: MissionSource, *, by: str = "") -> MissionApproval:
        """Withdraw the approval of a mission that `by` has given. What runs goes on.

        Raises:
            MissionError: it cannot be read.
            OperatorError: `by` has not approved it.
        """

    async def note_edit(self, digest: str, *, by: str = "") -> None:
        """Note who has made a file of a mission what it is, where the fleet asks for approvals.

        `digest`: the SHA-256 of the file, in hexadecimal. Editors call it before they save.
        """
