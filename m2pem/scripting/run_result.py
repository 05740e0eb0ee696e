"""What a run did: its outcome, its records, its Gantt chart, and its path through the diagram."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from m2pem.api.runs import RunStatus, RunSummary, StampedRecord, TelemetrySample
from m2pem.diagram.mission_files import draw_mission
from m2pem.diagram.overlays import Overlays
from m2pem.engine import records as r
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.rehearsal.gantt import gantt_svg
from m2pem.rehearsal.timeline import Span, read_timeline
from m2pem.scripting.html import Svg, headline, page, paragraph, picture


@dataclass(frozen=True, slots=True, repr=False)
class RunResult:
    """A run that has ended, rehearsed or executed. A notebook shows it with diagram and chart.

    `records`: all of them, each with its mission time in seconds. `telemetry`: of a rehearsal that
    was asked for it.
    """

    mission: Mission
    fleet: Fleet | None
    summary: RunSummary
    records: Sequence[StampedRecord]
    telemetry: Sequence[TelemetrySample] = ()

    @property
    def outcome(self) -> RunStatus:
        """`completed`, `terminated` (by an end event of the mission), `failed` or `stopped`."""
        return self.summary.status

    @property
    def ok(self) -> bool:
        """Whether the mission completed or terminated itself."""
        return self.outcome in (RunStatus.COMPLETED, RunStatus.TERMINATED)

    @property
    def detail(self) -> str:
        """Why it ended so, as a sentence; "" if the outcome says all."""
        return self.summary.detail

    @property
    def took_s(self) -> float:
        """Seconds from its start to its end, by the clock of the run, pauses too."""
        return self.summary.took_s or 0.0

    @property
    def path(self) -> list[str]:
        """The ids of the elements that a token entered, in their order."""
        records = (each.record for each in self.records)
        return [each.element for each in records if isinstance(each, r.TokenEntered)]

    @property
    def gantt(self) -> list[dict[str, Any]]:
        """The bars of the Gantt chart, for a table of your own.

        One for each resource of a behavior, each prompt and each service, with the keys `kind`
        (`behavior`, `prompt`, `service`), `resource` ("" for prompts and services), `what` (the
        behavior, service or decision), `element`, `start_s` and `end_s` (mission time), `outcome`
        and `note` (an error code, or who answered).
        """
        line = read_timeline(self.records)
        rows = [_row("prompt", "", each) for each in line.prompts]
        rows += [_row("service", "", each) for each in line.services]
        for resource, spans in line.resources.items():
            rows += [_row("behavior", resource, each) for each in spans]
        return sorted(rows, key=lambda row: (row["start_s"], row["end_s"]))

    @property
    def gantt_svg(self) -> Svg:
        """The Gantt chart as a picture, with a row for each resource of the fleet."""
        return Svg(gantt_svg(self.records, self.fleet))

    @property
    def diagram(self) -> Svg:
        """The mission's own diagram with the path that the run took; see `diagrams`."""
        return self.diagrams[self.mission.file]

    @property
    def diagrams(self) -> dict[str, Svg]:
        """By name of a file: its diagram with the path, step by step, and what failed.

        The mission's own file is the first; others follow if the run passed them.

        Raises:
            ValueError: a file has no diagram, and cannot be laid out.
        """
        names = {each.qualifier: each.name for each in self.mission.files()}
        names[""] = self.mission.file
        drawn = draw_mission(self.mission, path_overlays(self.records))
        return {names[qualifier]: Svg(svg) for qualifier, svg in drawn.items()}

    def to_html(self) -> str:
        """The result as an HTML document that needs no other file."""
        return page(f"{self.mission.file}: {self.outcome.value}", self._repr_html_())

    def __repr__(self) -> str:
        return f"<RunResult: {self.outcome.value}, {self._about()}>"

    def _repr_html_(self) -> str:
        parts = [headline(self.outcome.value, self._about())]
        if self.detail:
            parts.append(paragraph(self.detail))
        try:
            parts += [picture(svg) for svg in self.diagrams.values()]
        except ValueError as error:
            parts.append(paragraph(f"{self.mission.file} cannot be drawn: {error}"))
        parts.append(picture(self.gantt_svg))
        return "\n".join(parts)

    def _about(self) -> str:
        line = self.summary
        return (
            f"{line.mission}, process {line.process}, run {line.run}, {self.took_s:.1f} s, "
            f"{len(self.records)} records"
        )


def path_overlays(records: Iterable[StampedRecord]) -> Overlays:
    """The path of a run, a step for each element that a token entered.

    Where the run failed, the elements whose tokens failed last are marked with the reason.
    """
    steps: list[list[str]] = []
    failed: dict[str, str] = {}
    for stamped in records:
        match stamped.record:
            case r.TokenEntered(element=element, flow=flow):
                steps.append([element, flow] if flow else [element])
                failed = {}
            case r.TokenLeft(element=element, outcome=r.TokenOutcome.FAILED):
                failed[element] = ""
            case r.RunEnded(outcome=r.RunOutcome.FAILED, detail=detail):
                return Overlays(steps, stuck=dict.fromkeys(failed, detail))
            case _:
                pass
    return Overlays(steps)


def _row(kind: str, resource: str, span: Span) -> dict[str, Any]:
    return {
        "kind": kind,
        "resource": resource,
        "what": span.what,
        "element": span.element,
        "start_s": span.start_s,
        "end_s": span.end_s,
        "outcome": span.outcome.value,
        "note": span.note,
    }
