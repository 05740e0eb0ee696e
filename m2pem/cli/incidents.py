"""`m2pem incidents` and `m2pem resolve`: the errors about which operators decide."""

from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import (
    as_json,
    example,
    format_option,
    incident_data_option,
    journal_option,
    run_argument,
)
from m2pem.cli.run_control import ask_driving, by_option, executives_here, steer

if TYPE_CHECKING:
    from m2pem.api.allocation import WaitingTask
    from m2pem.api.runs import OpenIncident
    from m2pem.mission.values import Value

LONG_TIMEOUT_S = 120.0
"""The checker explores what follows a choice before it is made."""


@click.command(epilog=example("m2pem incidents"))
@journal_option
@format_option
def incidents(journal: str | None, output: str) -> None:
    """List the errors about which operators must decide.

    Those of all runs that executives on this host drive, each with what can be chosen, and with the
    tasks of any run that wait for what it holds.
    """
    from dataclasses import asdict

    import msgspec

    from m2pem.api.allocation import WaitingTask, blocked_by
    from m2pem.api.runs import OpenIncident
    from m2pem.control_socket.client import ask

    found: list[tuple[OpenIncident, list[WaitingTask]]] = []
    for socket in executives_here(journal):
        opened = msgspec.convert(ask(socket, "incidents"), list[OpenIncident])
        waiting = msgspec.convert(ask(socket, "waiting"), list[WaitingTask]) if opened else []
        found += [(each, blocked_by(each.incident, waiting)) for each in opened]
    if output == "json":
        listed = [{**asdict(each), "blocks": tasks} for each, tasks in found]
        click.echo(as_json({"incidents": listed}))
    else:
        texts = [_as_text(each, tasks) for each, tasks in found]
        click.echo("\n\n".join(texts) or "no incident is open")


def _as_text(incident: "OpenIncident", blocked: "list[WaitingTask]") -> str:
    lines = [str(incident), f"  choices: {', '.join(incident.choices)}"]
    if blocked:
        lines.insert(1, f"  blocked: {'; '.join(each.in_short() for each in blocked)}")
    if "retry_with" in incident.choices:
        roles = [f"{role}={','.join(ids)}" for role, ids in incident.roles.items()]
        lines.append(f"  roles for retry_with: {' '.join(roles)}")
    if "move" in incident.choices:
        lines.append(f"  targets of move: {', '.join(incident.targets)}")
    return "\n".join(lines)


def _read_roles(
    _: click.Context, __: click.Parameter, given: tuple[str, ...]
) -> dict[str, list[str]]:
    roles: dict[str, list[str]] = {}
    for word in given:
        role, equals, names = word.partition("=")
        if not (role and equals and names):
            raise click.BadParameter(f"{word!r} is not of the form ROLE=RESOURCE")
        roles.setdefault(role, []).extend(names.split(","))
    return roles


@click.command(epilog=example("m2pem resolve r1 i1 retry_with --with scout=uav2"))
@run_argument
@click.argument("incident")
@click.argument(
    "choice", type=click.Choice(["retry", "retry_with", "skip", "set_data", "move", "end"])
)
@incident_data_option
@click.option("--to", metavar="ID", default="", help="The element or sequence flow to move to.")
@click.option(
    "--with",
    "roles",
    metavar="ROLE=RESOURCE",
    multiple=True,
    callback=_read_roles,
    help="Who fills a role instead: several with commas, or a team. Can be given again.",
)
@click.option(
    "--even-if-stuck",
    is_flag=True,
    help="Confirm a choice after which the mission cannot complete.",
)
@click.option("--preview", is_flag=True, help="Only say whether the mission completes after it.")
@journal_option
@by_option
def resolve(
    run_id: str,
    incident: str,
    choice: str,
    data: "dict[str, Value]",
    to: str,
    roles: dict[str, list[str]],
    even_if_stuck: bool,
    preview: bool,
    journal: str | None,
    by: str | None,
) -> None:
    """Decide about an incident of a run that is running on this host.

    The first choice wins; a later one ends with 1. `set_data` leaves the incident open.
    """
    params: dict[str, Any] = {
        "incident": incident,
        "choice": choice,
        "data": data,
        "to": to,
        "roles": roles,
    }
    if preview:
        _preview(journal, run_id, params)
        return
    from m2pem.errors import OperatorError, StuckError

    done = f"{run_id}: {incident}: {choice}"
    params["even_if_stuck"] = even_if_stuck
    try:
        steer(journal, run_id, "resolve_incident", by, done, timeout_s=LONG_TIMEOUT_S, **params)
    except StuckError as error:
        raise OperatorError(f"{error}. --even-if-stuck does it all the same") from error


def _preview(journal: str | None, run: str, params: dict[str, Any]) -> None:
    import msgspec

    from m2pem.api.runs import IncidentPreview

    sent = ask_driving(journal, run, "preview_incident", timeout_s=LONG_TIMEOUT_S, **params)
    click.echo(str(msgspec.convert(sent, IncidentPreview)))
