"""Proves properties of a mission: what `m2pem verify` prints, as an object."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from m2pem.api.authoring import MissionSource
from m2pem.executive import verification
from m2pem.executive.verification import SearchEngine, SearchRequest
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.plugins import PluginManager
from m2pem.scripting.html import Svg, headline, numbered, page, paragraph, picture, table
from m2pem.scripting.sources import FleetSource, arbiters_of, fleet_of, load_mission
from m2pem.verify.properties.results import Verdict
from m2pem.verify.report.data import as_data
from m2pem.verify.report.findings import DescribedViolation, Findings
from m2pem.verify.report.picture import pictures
from m2pem.verify.report.text import as_text, covered
from m2pem.verify.search.explore import AFTER_VIOLATION_STATES, Limits, Progress

MAX_STATES = 2_000_000
MAX_SECONDS = 600.0
"""Where a search ends undecided, unless said otherwise."""

TOKENS_ON_A_PLACE = 3
"""More tokens than this on a place where one is meant end a search undecided."""


@dataclass(frozen=True, slots=True, repr=False)
class VerificationResult:
    """What holds of a mission, and the runs that violate the rest. A notebook shows it as a report.

    `findings` has everything, as objects of `m2pem.verify.report.findings`. `str` gives the text
    that `m2pem verify` prints.
    """

    findings: Findings

    @property
    def holds(self) -> bool:
        """Whether every property and requirement holds."""
        return self.findings.verdict is Verdict.HOLDS

    @property
    def verdict(self) -> str:
        """`holds`, `violated` or `undecided`."""
        return self.findings.verdict.value

    @property
    def properties(self) -> list[dict[str, Any]]:
        """Each property and requirement with its verdict, as in docs/verification.schema.json."""
        properties: list[dict[str, Any]] = self.to_dict()["properties"]
        return properties

    @property
    def violations(self) -> list[dict[str, Any]]:
        """Each violation with the run that leads to it, as in docs/verification.schema.json."""
        violations: list[dict[str, Any]] = self.to_dict()["violations"]
        return violations

    @property
    def diagram(self) -> Svg:
        """The mission's diagram with the first violation, or with what no run reaches.

        Raises:
            ValueError: the file has no diagram, and cannot be laid out.
        """
        return Svg(pictures(self.findings, next(iter(self.findings.violations), None))[""])

    def to_dict(self) -> dict[str, Any]:
        """All of it, as `m2pem verify --format json` prints it."""
        return as_data(self.findings)

    def to_html(self) -> str:
        """The report as an HTML document that needs no other file."""
        return page(f"{self.findings.mission.file}: {self.verdict}", self._repr_html_())

    def __str__(self) -> str:
        return as_text(self.findings)

    def __repr__(self) -> str:
        return f"<VerificationResult: {self.findings.mission.file}: {self.verdict}>"

    def _repr_html_(self) -> str:
        found = self.findings
        about = f"{found.mission.file}, process {found.net.process}; {covered(found.coverage)}"
        rows = [
            (answer.verdict.value, answer.property, f"{answer.text} {answer.covered}".strip())
            if not answer.violations or found.counts(answer)
            else ("warning", answer.property, answer.text)
            for answer in found.results
        ]
        parts = [headline(self.verdict, about), table(("", "property", "what it says"), rows)]
        for violation in found.violations:
            parts += self._violation(violation)
        return "\n".join(parts)

    def _violation(self, violation: DescribedViolation) -> list[str]:
        found = self.findings
        doubt = violation.found.doubt
        kind = (Verdict.MAY_BE_VIOLATED if doubt else Verdict.VIOLATED).value
        if not found.counts(violation.answer):
            kind = "warning"
        parts = [headline(kind, f"{violation.answer.property}: {violation.found.message}")]
        if doubt:
            parts.append(paragraph(f"It may be a false alarm: {doubt}."))
        if violation.run_steps or violation.loop:
            try:
                parts += [picture(svg) for svg in pictures(found, violation).values()]
            except ValueError as error:
                parts.append(paragraph(f"{found.mission.file} cannot be drawn: {error}"))
            parts.append(numbered(each.text for each in (*violation.run_steps, *violation.loop)))
        return parts


def search_request(
    mission: Mission,
    fleet: FleetSource | None,
    process: str | None,
    data: Mapping[str, Value],
    requirements: Path | bytes | None = None,
    *,
    timers_in_order: bool = False,
    assume: Iterable[str] = (),
    all_pools: bool = False,
) -> SearchRequest:
    """Return the search of a mission in which `check` finds no errors.

    `requirements`: a file of more of them, or its text. `assume`: what the whole check assumes.
    `all_pools`: the pools that nothing triggers begin with the run.

    Raises:
        MissionError: there are errors; it lists all.
        FleetError: the fleet cannot be used.
        RequirementsError: requirements cannot be read, or do not fit; it lists all findings.
    """
    plugins = PluginManager()
    arbiters = arbiters_of(fleet_of(fleet, mission), plugins) if fleet is not None else None
    return verification.search_request(
        mission,
        arbiters,
        plugins,
        process,
        data,
        requirements,
        timers_in_order=timers_in_order,
        assume=assume,
        all_pools=all_pools,
    )


def verify(
    mission: MissionSource | Mission,
    fleet: FleetSource | None = None,
    *,
    process: str | None = None,
    data: Mapping[str, Value] | None = None,
    requirements: str | Path | bytes | None = None,
    strict: bool = False,
    timers_in_order: bool = False,
    assume: str | Iterable[str] = (),
    all_pools: bool = False,
    engine: Literal["builtin", "spin"] = "builtin",
    storage: Literal["exact", "collapse", "bitstate"] = "exact",
    max_states: int = MAX_STATES,
    max_seconds: float = MAX_SECONDS,
    exhaustive: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
    search_path: Iterable[str | Path] = (),
) -> VerificationResult:
    """Prove properties and requirements of a mission, or find runs that violate them.

    As `m2pem verify`, whose options these are. `fleet` None: one is made up. `requirements`: a
    YAML file, or its text as bytes, beside those in the mission's own file. `assume`: what all runs
    are taken to do, such as "no-failures". `all_pools`: the pools of a collaboration that nothing
    triggers begin with the run. `strict`: warnings are violations. `engine`: `builtin` or `spin`;
    `storage`, of Spin alone: `exact`, `collapse` or `bitstate`. `max_states` and `max_seconds` end
    a search undecided; so does an interrupt of the kernel (Ctrl-C), with what has been searched.
    After a violation a large search ends soon, unless it is `exhaustive`. `on_progress` is called
    now and then.

    Raises:
        MissionError: `check` finds errors; it lists all.
        FleetError: the fleet cannot be used.
        RequirementsError: requirements cannot be read, or do not fit; it lists all findings.
        ValueError: there is no such engine, or the storage is not one of the engine.
    """
    if engine not in ("builtin", "spin"):
        raise ValueError(f"there is no engine {engine!r}: builtin or spin")
    if storage != "exact" and engine != "spin":
        raise ValueError(f"storage {storage!r} says how Spin searches: add engine='spin'")
    loaded = load_mission(mission, search_path)
    more = Path(requirements) if isinstance(requirements, str) else requirements
    request = search_request(
        loaded,
        fleet,
        process,
        data or {},
        more,
        timers_in_order=timers_in_order,
        assume=(assume,) if isinstance(assume, str) else assume,
        all_pools=all_pools,
    )
    limits = Limits(
        states=max_states,
        seconds=max_seconds,
        tokens=TOKENS_ON_A_PLACE,
        after_violation=None if exhaustive else AFTER_VIOLATION_STATES,
    )
    search_engine = SearchEngine(engine, storage, limits)
    found = verification.search(request, search_engine, strict=strict, progress=on_progress)
    return VerificationResult(found)
