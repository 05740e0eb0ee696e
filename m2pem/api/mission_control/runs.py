"""Operations on runs: begin them, steer them, answer them, end them."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from m2pem.api.allocation import StartPreview
from m2pem.api.authoring import MissionSource
from m2pem.api.runs import RunId
from m2pem.mission.values import Value


class RunControl(Protocol):
    """The operations of `MissionControl` on runs."""

    async def start(
        self,
        mission: MissionSource,
        *,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
        even_if_busy: bool = False,
    ) -> RunId:
        """Start a mission.

        `even_if_busy`: an operator has confirmed that it starts although other runs or operators
        have vehicles or payloads that it names.

        Raises:
            MissionError: with every finding, when it is not well or does not fit the fleet.
            BusyError: they have some, and that was not confirmed; it says who has what.
            NotApprovedError: the fleet asks for approvals, and persons must give them before.
        """

    async def execute_behavior(
        self,
        resource: str,
        behavior: str,
        parameters: Mapping[str, Value] | None = None,
        *,
        by: str = "",
    ) -> RunId:
        """Command one behavior on one vehicle or payload, from outside of a mission.

        It is a run of its own, with a mission of one task: `wait` and `subscribe` follow it, `stop`
        ends it. A resource that `by` has taken (`take`) stays taken. In place of what `by` had it
        do by an earlier call, which is stopped first. `parameters`: as in a mission file, texts
        with units or names of geometries, numbers in SI, lists `[latitude, longitude]`; also
        GeoJSON objects.

        Raises:
            MissionError: the resource cannot do it, or a parameter is wrong.
            BusyError: a run, or another operator, has the resource.
            OperatorError: the fleet has no such resource; or a later call for it came, while this
                one waited until the resource had stopped.
        """

    async def missions(self) -> Sequence[str]:
        """The paths of the mission files that are found where the executive runs.

        They are in the folders of its search path, in its working folder, and in `missions` there.
        """

    async def preview_start(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> StartPreview:
        """What `start` of a mission would begin with now, and what speaks against it.

        `data`: names that are given at start. Operators see this before they start a mission.
        """

    async def pause(self, run: RunId, *, by: str = "") -> None:
        """Hold every commanded resource and freeze timers.

        The holds go to the arbiters at once, as the cancels of `stop` do; errors as there.
        """

    async def resume(self, run: RunId, *, by: str = "") -> None:
        """Go on after a pause."""

    async def signal(
        self,
        signal: str,
        *,
        run: RunId | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
    ) -> None:
        """Emit a signal, by its id or its name, to one run or (None) to all that have it."""

    async def message(
        self, message: str, *, run: RunId, data: Mapping[str, Value] | None = None, by: str = ""
    ) -> None:
        """Send a message, by its id."""

    async def answer(self, run: RunId, prompt: str, decision: str, *, by: str = "") -> None:
        """Answer a prompt. The first answer wins; a later one raises OperatorError, and so does one
        of an operator who has not the role of the prompt, where the fleet file says who has it."""

    async def add_note(self, run: RunId, text: str, *, by: str = "") -> None:
        """Write a note into a run's log: a record, which every operator sees.

        Raises:
            OperatorError: it is empty or too long (`MAX_NOTE_CHARACTERS`), or the run has ended.
        """

    async def stop(self, run: RunId, *, by: str = "", reason: str = "") -> None:
        """End every token, cancel every behavior.

        The cancels go to the arbiters at once, before the run decides and whatever the journal
        does. Until the run has decided it, it starts no behavior any more.

        Raises:
            OperatorError: the run has ended; or the cancels are sent, and the journal has not
                written the stop within 1.5 s.
        """

    async def stop_all(self, *, by: str = "", reason: str = "") -> Sequence[RunId]:
        """Stop every run that has not ended, as `stop` does; returns them.

        The schedule, if it has entries, is held from then on until an operator releases it.

        Raises:
            OperatorError: as for `stop`; names each run concerned. The others are stopped.
        """
