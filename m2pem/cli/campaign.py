"""`m2pem campaign`: one mission rehearsed many times, with what is drawn."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import (
    UnusableError,
    as_json,
    data_option,
    example,
    fleet_option,
    mission_argument,
    path_option,
    process_option,
)

if TYPE_CHECKING:
    from m2pem.campaign.campaign import CampaignResult
    from m2pem.campaign.runs import Order
    from m2pem.campaign.statistics import SequentialTest
    from m2pem.mission.mission import Mission
    from m2pem.mission.values import Value

INTERRUPTED = 130


def _read_test(_: click.Context, __: click.Parameter, text: str | None) -> "SequentialTest | None":
    if text is None:
        return None
    from m2pem.campaign.statistics import SequentialTest

    try:
        p0, p1, alpha, beta = (float(part) for part in text.split(","))
        return SequentialTest(p0, p1, alpha, beta)
    except ValueError as error:
        wanted = "P0,P1,ALPHA,BETA such as 0.01,0.02,0.05,0.05"
        raise click.BadParameter(f"{text!r} is not {wanted}: {error}") from error


def _print_schema(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or context.resilient_parsing:
        return
    from m2pem.campaign.variations_file import variations_schema

    click.echo(as_json(variations_schema()))
    context.exit()


@click.command(
    epilog=example(
        "m2pem campaign missions/survey_pair.bpmn --fleet fleet_configs/survey_pair.yaml "
        "--runs 200 --vary wind=0..14 --seed 7"
    )
)
@mission_argument
@fleet_option(required=True)
@process_option
@path_option
@data_option
@click.option(
    "--runs", type=click.IntRange(min=1), default=1000, show_default=True, help="How many."
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of all that is drawn.")
@click.option(
    "--faults",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="What is drawn: a variations file (docs/campaigns.md).",
)
@click.option(
    "--vary",
    "varied",
    multiple=True,
    metavar="NAME=LOW..HIGH",
    help="Draw one more: wind=0..8, or a setting of a vehicle: uav1.battery=60%..100%. Repeatable.",
)
@click.option(
    "--require",
    "required",
    multiple=True,
    metavar="ID",
    help="Count runs that violate this requirement of the mission's file as failures. Repeatable.",
)
@click.option("--workers", type=click.IntRange(min=1), help="Processes  [default: one a core]")
@click.option("--cluster", metavar="URL", default="", help="Of a Dask scheduler, in their place.")
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Write rows, report, plots and the worst runs there.",
)
@click.option("--resume", is_flag=True, help="Go on with the campaign in the folder of --out.")
@click.option(
    "--sprt",
    "test",
    metavar="P0,P1,ALPHA,BETA",
    callback=_read_test,
    help="End as soon as it is decided whether failures have probability P0 or P1 (Wald's test).",
)
@click.option(
    "--against",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="MISSION",
    help="Compare with another mission, with the same random numbers.",
)
@click.option(
    "--against-fleet",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FLEET",
    help="Compare with another fleet, with the same random numbers.",
)
@click.option(
    "--schema",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_schema,
    help="Print the JSON Schema of variations files instead.",
)
def campaign(
    mission: str,
    fleet_file: str,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    runs: int,
    seed: int,
    faults: Path | None,
    varied: tuple[str, ...],
    required: tuple[str, ...],
    workers: int | None,
    cluster: str,
    out: Path | None,
    resume: bool,
    test: "SequentialTest | None",
    against: Path | None,
    against_fleet: Path | None,
) -> int:
    """Rehearse a mission many times, with faults and times that are drawn.

    Prints the probability of each end, times, batteries, and what failures depend on. The same
    seed gives the same runs on any number of processes or computers. An interrupt (Ctrl-C) keeps
    what is done.
    """
    from m2pem.campaign.report import report_of
    from m2pem.campaign.report_files import markdown_lines, write_report
    from m2pem.executive.loading import load_source

    if resume and out is None:
        raise UnusableError("--resume goes on in a folder: name it with --out")
    text = _variations(faults, varied)
    loaded = load_source(mission, search_path)
    arguments: dict[str, Any] = {
        "seed": seed,
        "process": process,
        "data": data,
        "required": required,
    }
    order = _order(loaded, fleet_file, text, arguments)
    options: dict[str, Any] = {"workers": workers, "cluster": cluster, "resume": resume}
    other_order = None
    if against is not None or against_fleet is not None:
        other = loaded if against is None else load_source(str(against), search_path)
        fleet = fleet_file if against_fleet is None else str(against_fleet)
        other_order = _order(other, fleet, text, arguments)
    result = _run(order, runs, test=test, out=out, options=options)
    compared = None
    if other_order is not None and not result.interrupted:
        beside = None if out is None else out / "against"
        compared = _run(other_order, runs, test=None, out=beside, options=options)
    if out is not None:
        write_report(out, result, compared)
    click.echo("\n".join(markdown_lines(report_of(result, compared))))
    interrupted = result.interrupted or (compared is not None and compared.interrupted)
    return INTERRUPTED if interrupted else 0


def _order(
    mission: "Mission", fleet_file: str, variations: bytes, arguments: dict[str, Any]
) -> "Order":
    from m2pem.campaign.runs import order_of
    from m2pem.scripting.sources import fleet_of

    return order_of(mission, fleet_of(fleet_file, mission), variations, **arguments)


def _run(
    order: "Order",
    runs: int,
    *,
    test: "SequentialTest | None",
    out: Path | None,
    options: dict[str, Any],
) -> "CampaignResult":
    from os import cpu_count

    from m2pem.campaign.campaign import run_campaign
    from m2pem.cli.notes import progress_line, share

    with progress_line() as show:
        return run_campaign(
            order,
            runs,
            workers=options["workers"] or cpu_count() or 1,
            cluster=options["cluster"],
            folder=out,
            resume=options["resume"],
            test=test,
            on_progress=lambda done: show(lambda: share(done, runs, "runs")),
        )


def _variations(file: Path | None, varied: tuple[str, ...]) -> bytes:
    """Return the text of the variations: those of the file, and those of `--vary`."""
    if not varied:
        return b"" if file is None else _checked(file)
    from m2pem.fleet.yaml_source import read_yaml

    content: dict[str, Any] = {}
    if file is not None:
        _checked(file)
        read = read_yaml(file).data
        content = dict(read) if isinstance(read, dict) else {}
    for each in varied:
        name, equals, said = each.partition("=")
        vehicle, dot, setting = name.rpartition(".")
        if not equals or (name != "wind" and not (vehicle and dot)):
            raise UnusableError(
                f"--vary {each!r} is neither wind=LOW..HIGH nor VEHICLE.SETTING=LOW..HIGH"
            )
        if name == "wind":
            content["wind"] = {**content.get("wind", {}), "speed": said}
        else:
            vehicles = {key: dict(of) for key, of in content.get("vehicles", {}).items()}
            vehicles.setdefault(vehicle, {})[setting] = said
            content["vehicles"] = vehicles
    return json.dumps(content).encode()


def _checked(file: Path) -> bytes:
    from m2pem.campaign.runs import read_text

    return read_text(file)
