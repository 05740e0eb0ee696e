"""The runs of a campaign, a chunk at a time: what each process of a pool or cluster does."""

import json
import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from m2pem.api.authoring import MissionFiles
from m2pem.api.data_text import value_of
from m2pem.api.runs import RunStatus, StampedRecord
from m2pem.campaign.variations import DrawnRun, Variations, read_variations
from m2pem.engine import records as r
from m2pem.errors import M2pemError, OperatorError
from m2pem.executive.loading import load_source, monitored_requirements
from m2pem.fleet.fleet import dump, restore
from m2pem.mission.elements import EndEvent
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import Answers
from m2pem.rehearsal.answers_file import AnswersModel
from m2pem.rehearsal.rehearsal import RehearsalResult, Rehearser, uses_left
from m2pem.suggestions import suggest

if TYPE_CHECKING:
    from m2pem.fleet.fleet import Fleet

Row = dict[str, Any]
"""One run: `run`, `outcome`, `end`, `good`, `took_s`, `records` (but those of progress), `error`;
`battery.VEHICLE` at its end, a fraction; `distance.VEHICLE`: the way it has gone, in m;
`requirement.ID`: "satisfied", "violated", or "open" if its end has not decided it; `drawn.NAME`.
`good`: it has completed or was terminated, and violates nothing that is required. `error`: why it
could not be rehearsed; such a run has nothing else. `weight`: how many times as likely it is as it
was drawn."""

_GOOD = (RunStatus.COMPLETED, RunStatus.TERMINATED)
_VIOLATED = r.RequirementVerdict.VIOLATED.value

MAX_STEPS = 100_000
"""Engine steps after which a run is given up."""


@dataclass(frozen=True, slots=True)
class Order:
    """All that the runs of a campaign depend on but their numbers. It is pickled for other
    processes; `variations` is the text of the file. `required`: requirements that a good run does
    not violate."""

    mission: MissionFiles
    fleet: bytes
    variations: bytes
    seed: int
    process: str | None
    data: Mapping[str, Value]
    max_steps: int = MAX_STEPS
    required: tuple[str, ...] = ()

    def __hash__(self) -> int:
        return hash((self.mission.source, self.fleet, self.variations, self.seed, self.process))


def order_of(
    mission: Mission,
    fleet: "Fleet",
    variations: bytes,
    seed: int,
    *,
    process: str | None = None,
    data: Mapping[str, Value] | None = None,
    max_steps: int = MAX_STEPS,
    required: Sequence[str] = (),
) -> Order:
    """Return the order of a campaign. `required`: ids of requirements in the mission's file.

    Raises:
        AnswersError: the variations cannot be used, or do not fit mission and fleet.
        OperatorError: runs of the mission are not monitored for such a requirement.
    """
    read_variations(variations).refuse_misfits(mission, fleet)
    monitored = monitored_requirements(mission, fleet, PluginManager(), data or ())
    known = {each.id for each in monitored}
    for name in required:
        if not any(_is_of(name, each) for each in known):
            hint = suggest(name, sorted(known), "requirements of runs")
            raise OperatorError(f"{mission.file} has no requirement {name!r} to monitor; {hint}")
    meant = tuple(sorted(each for each in known if any(_is_of(name, each) for name in required)))
    files = MissionFiles(mission.file, mission.source, mission.library)
    given = dict(data or {})
    return Order(files, dump(fleet), variations, seed, process, given, max_steps, meant)


def _is_of(name: str, requirement: str) -> bool:
    """Whether a name means a requirement: its id, or that of one for each vehicle, `ID/VEHICLE`."""
    return requirement == name or requirement.startswith(f"{name}/")


@lru_cache(maxsize=2)
def _prepared(order: Order) -> tuple[Rehearser, Variations]:
    """Read and check everything once in this process."""
    return _rehearser(order, reports_left=False), read_variations(order.variations)


def _rehearser(order: Order, *, reports_left: bool) -> Rehearser:
    """`reports_left` False: if the mission does not need it. That takes half the time."""
    mission = load_source(order.mission)
    return Rehearser(
        mission,
        restore(order.fleet),
        PluginManager(),
        order.process,
        reports_left=reports_left or uses_left(mission),
    )


def rehearse_runs(order: Order, runs: Sequence[int]) -> list[Row]:
    """Rehearse some runs of a campaign, and return a row for each, in their order."""
    return [rehearse_run(order, run) for run in runs]


def rehearse_run(order: Order, run: int) -> Row:
    """Rehearse one run, and return its row."""
    rehearser, variations = _prepared(order)
    drawn = variations.draw(order.seed, run)
    try:
        result = _rehearse(rehearser, order, drawn)
    except M2pemError as error:
        return {"run": run, "error": str(error)}
    return row_of(run, rehearser.mission, result, drawn, order.required)


def replayed(order: Order, run: int) -> tuple[DrawnRun, RehearsalResult]:
    """Rehearse a run again, as `m2pem simulate` would: what was drawn for it, and its result."""
    _, variations = _prepared(order)
    drawn = variations.draw(order.seed, run)
    return drawn, _rehearse(_rehearser(order, reports_left=True), order, drawn)


def _rehearse(rehearser: Rehearser, order: Order, drawn: DrawnRun) -> RehearsalResult:
    return rehearser.rehearse(
        data=order.data,
        answers=Answers(AnswersModel.model_validate(drawn.answers)),
        max_steps=order.max_steps,
        observed=False,
        fits=True,
    )


def row_of(
    run: int,
    mission: Mission,
    result: RehearsalResult,
    drawn: DrawnRun,
    required: Collection[str] = (),
) -> Row:
    """Return the row of a run that was rehearsed. `required`: see `Order`."""
    summary = result.summary
    verdicts = verdicts_of(result.records)
    row: Row = {
        "run": run,
        "outcome": summary.status.value,
        "end": end_of(mission, summary.status, result.records),
        "good": summary.status in _GOOD and all(verdicts[each] != _VIOLATED for each in required),
        "took_s": summary.took_s,
        "records": sum(type(each.record) is not r.BehaviorProgressed for each in result.records),
        "error": "",
        "weight": drawn.weight,
    }
    for vehicle, at_end in result.vehicles.items():
        row[f"battery.{vehicle}"] = at_end.battery
        row[f"distance.{vehicle}"] = at_end.distance_m
    row.update({f"requirement.{key}": verdict for key, verdict in verdicts.items()})
    row.update({f"drawn.{key}": value for key, value in drawn.values.items()})
    return row


def verdicts_of(records: Iterable[StampedRecord]) -> dict[str, str]:
    """Return the verdict on each requirement that a run was monitored for."""
    found: dict[str, str] = {}
    for stamped in records:
        match stamped.record:
            case r.RequirementMonitored(requirement=name):
                found.setdefault(name, "open")
            case r.RequirementDecided(requirement=name, verdict=verdict):
                found[name] = verdict.value
            case _:
                pass
    return found


def end_of(mission: Mission, status: RunStatus, records: Iterable[StampedRecord]) -> str:
    """Return how a run has ended: the end events of its process that were reached, sorted, or the
    code of the error that no event caught."""
    ends: set[str] = set()
    code = ""
    first = ""
    for stamped in records:
        match stamped.record:
            case r.RunStarted():
                first = stamped.record.process
            case r.TokenEntered() as entered:
                node = mission.elements.get(entered.element)
                if isinstance(node, EndEvent):
                    ends.add(node.id)
            case r.ErrorThrown():
                code = stamped.record.code
            case _:
                pass
    if status is RunStatus.FAILED:
        return code or "given up"
    own = {node.id for node in mission.process(first or None).nodes if isinstance(node, EndEvent)}
    return ", ".join(sorted(ends & own))


def answers_text(drawn: DrawnRun, remark: str) -> str:
    """Return a drawn run as an answers file, that begins with a remark."""
    from io import StringIO  # noqa: PLC0415  # only what writes files needs it

    from ruamel.yaml import YAML  # noqa: PLC0415

    out = StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.width = 120
    yaml.dump(drawn.answers, out)
    return "".join(f"# {line}\n" for line in remark.splitlines()) + out.getvalue()


def replay_command(order: Order, answers: Path) -> str:
    """Return the command, for a shell, that rehearses a run of a campaign again from its answers
    file: the same records, in the folder in which the campaign was begun."""
    words = ["m2pem", "simulate", order.mission.file, "--fleet", restore(order.fleet).file]
    if order.process is not None:
        words += ["--process", order.process]
    own = Path(order.mission.file).parent
    called = [
        each for each in order.mission.library if any(of == "call" for of, *_ in each.answers)
    ]
    for folder in dict.fromkeys(Path(each.name).parent for each in called):
        if folder != own:
            words += ["--path", str(folder)]
    for name, value in order.data.items():
        words += ["--data", f"{name}={_written(value)}"]
    words += ["--answers", str(answers), "--max-steps", str(order.max_steps)]
    return shlex.join(words)


def _written(value: Value) -> str:
    """Return a value of the data as `--data` reads it."""
    if isinstance(value, str):
        try:
            if value_of(value, "") == value:
                return value
        except OperatorError:
            pass  # it needs quotes
    return json.dumps(value, ensure_ascii=False)


def read_text(file: Path) -> bytes:
    """Read the text of a variations file, whose shape is checked with its name.

    Raises:
        AnswersError: it cannot be read or used.
    """
    read_variations(file)
    return file.read_bytes()
