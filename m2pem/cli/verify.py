"""`m2pem verify`: prove a mission before it moves anything."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import (
    UnusableError,
    as_json,
    data_option,
    example,
    fleet_option,
    format_option,
    mission_argument,
    path_option,
    process_option,
)

if TYPE_CHECKING:
    from m2pem.model.mission import Mission
    from m2pem.model.values import Value
    from m2pem.resources.fleet import Fleet
    from m2pem.verify.check import Report
    from m2pem.verify.derive import Options
    from m2pem.verify.results import Result, Violation

STATUS = {"holds": 0, "violated": 1, "undecided": 3}


@click.command(
    epilog=example("m2pem verify missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml")
)
@mission_argument
@fleet_option(required=False)
@process_option
@path_option
@data_option
@click.option("--strict", is_flag=True, help="Warnings are violations.")
@click.option(
    "--engine",
    type=click.Choice(["builtin", "spin"]),
    default="builtin",
    show_default=True,
    help="Who searches: m2pem itself, or the model checker Spin, if it is installed.",
)
@click.option(
    "--storage",
    type=click.Choice(["exact", "collapse", "bitstate"]),
    default="exact",
    show_default=True,
    help="How Spin remembers states: as they are, compressed, or as a few bits, which finds "
    "violations in very large missions but proves nothing.",
)
@click.option(
    "--emit",
    metavar="promela[=FILE]",
    help="Check nothing: print what Spin would be given, or write it to FILE.",
)
@click.option(
    "--max-states",
    type=click.IntRange(min=1),
    default=2_000_000,
    show_default=True,
    help="States after which it is given up, undecided.",
)
@format_option
def verify(
    mission: str,
    fleet_file: str | None,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    strict: bool,
    engine: str,
    storage: str,
    emit: str | None,
    max_states: int,
    output: str,
) -> int:
    """Prove a mission before it moves anything.

    Looks at every order in which answers, reports, timers and signals can come. Ends with 0 if all
    holds, with 1 if something is violated, with 2 if the mission cannot be used, and with 3 if
    the search was cut short and saw no violation.
    """
    if storage != "exact" and engine != "spin":
        raise click.UsageError(f"--storage {storage} says how Spin searches: add --engine spin")
    if emit is not None and emit.partition("=")[0] != "promela":
        raise click.UsageError(f"--emit {emit}: 'promela' or 'promela=FILE' can be written")
    from m2pem.cli.given import get_fleet
    from m2pem.executive.loading import load_source
    from m2pem.plugins import PluginManager
    from m2pem.verify.check import check
    from m2pem.verify.derive import Options
    from m2pem.verify.explore import Limits

    loaded = load_source(mission, search_path)
    fleet = get_fleet(fleet_file, loaded) if fleet_file is not None else None
    plugins = PluginManager()
    writes = {name: tuple(plugins.service(name)().writes) for name in plugins.services()}
    options = Options(data=data, service_writes=writes)
    limits = Limits(states=max_states, tokens=3)
    try:
        if emit is not None:
            return _emit(emit, loaded, fleet, process, options)
        if engine == "spin":
            from m2pem.verify.spin.asking import Storage
            from m2pem.verify.spin.checking import check_with_spin

            report = check_with_spin(
                loaded,
                fleet,
                process=process,
                options=options,
                limits=limits,
                storage=Storage(storage),
            )
        else:
            report = check(loaded, fleet, process=process, options=options, limits=limits)
    except KeyError:
        raise UnusableError(f"{mission} has no process {process!r}") from None
    verdict = report.judged(strict=strict).value
    if output == "json":
        click.echo(as_json(_as_data(mission, report, verdict)))
    else:
        for line in _lines(mission, report, verdict):
            click.echo(line)
    return STATUS[verdict]


def _emit(
    emit: str,
    mission: "Mission",
    fleet: "Fleet | None",
    process: str | None,
    options: "Options",
) -> int:
    """Write the model that Spin would be given."""
    from m2pem.verify.derive import derive
    from m2pem.verify.simplify import simplify
    from m2pem.verify.spin.promela import text_of

    text = text_of(simplify(derive(mission, fleet, process=process, options=options))).text
    file = emit.partition("=")[2]
    if not file:
        click.echo(text, nl=False)
        return 0
    try:
        Path(file).write_text(text, encoding="utf-8")
    except OSError as error:
        raise UnusableError(f"{file} cannot be written: {error.strerror}") from error
    return 0


def _lines(mission: str, report: "Report", verdict: str) -> list[str]:
    lines: list[str] = []
    for result in report.results:
        word = result.verdict.value
        if word == "violated" and result.warning:
            word = "warning"
        lines.append(f"{word:>9}  {result.text} [{result.property}]")
        if result.covered:
            lines.append(f"{'':>11}seen: {result.covered}")
        for violation in result.violations:
            lines.append(f"{'':>11}{violation.message}")
            path = _path(report, result, violation)
            if path:
                lines.append(f"{'':>13}run: {' -> '.join(path)}")
    for each in report.system.approximations:
        lines.append(f"{'note':>9}  {each.element}: {each.what} [{each.exactness.value}]")
    lines += [f"{'note':>9}  {each}" for each in report.notes]
    seconds = report.found.seconds
    lines.append(f"{mission}: {verdict} ({report.states:,} states, {seconds * 1e3:.0f} ms)")
    return lines


def _steps(report: "Report", result: "Result", violation: "Violation") -> list[dict[str, Any]]:
    """What happens in the run to a violation, step by step."""
    system = report.system
    if result.property == "interrupted-commanded-again" and report.watched is not None:
        system = report.watched
    return [
        {
            "rule": system.rules[number].name,
            "kind": system.rules[number].kind.value,
            "trigger": trigger.value if (trigger := system.rules[number].trigger) else None,
            "detail": system.rules[number].detail,
            "steps": [
                {"element": s.element, "action": s.action.value, "detail": s.detail}
                for s in system.rules[number].steps
            ],
        }
        for number in violation.run
    ]


def _path(report: "Report", result: "Result", violation: "Violation") -> list[str]:
    """The elements that the run comes to, each once in a row."""
    path: list[str] = []
    for each in _steps(report, result, violation):
        for step in each["steps"]:
            element = str(step["element"])
            if step["action"] != "taken" and (not path or path[-1] != element):
                path.append(element)
    return path


def _as_data(mission: str, report: "Report", verdict: str) -> dict[str, Any]:
    return {
        "mission": mission,
        "verdict": verdict,
        "engine": report.engine,
        "states": report.states,
        "seconds": report.found.seconds,
        "stopped": report.found.stopped.value if report.found.stopped else None,
        "notes": list(report.notes),
        "properties": [
            {
                "property": result.property,
                "text": result.text,
                "verdict": result.verdict.value,
                "warning": result.warning,
                "covered": result.covered,
                "violations": [
                    {
                        "message": violation.message,
                        "elements": list(violation.elements),
                        "run": _steps(report, result, violation),
                    }
                    for violation in result.violations
                ],
            }
            for result in report.results
        ],
        "approximations": [
            {"element": a.element, "exactness": a.exactness.value, "what": a.what}
            for a in report.system.approximations
        ],
    }
