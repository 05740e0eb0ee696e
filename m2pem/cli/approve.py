"""`m2pem approve`: a person approves a mission, which may start then."""

import asyncio
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    as_json,
    example,
    fleet_option,
    format_option,
    journal_option,
    mission_argument,
    path_option,
)
from m2pem.cli.run_control import by_option, journal_file

if TYPE_CHECKING:
    from m2pem.api.approval import MissionApproval
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.mission import Mission


@click.command(
    epilog=example("m2pem approve missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml")
)
@mission_argument
@fleet_option(required=True)
@path_option
@click.option("--withdraw", is_flag=True, help="Withdraw your approval of it instead.")
@click.option("--show", is_flag=True, help="Only show who has approved it, and who must.")
@journal_option
@by_option
@format_option
def approve(
    mission: str,
    fleet_file: str,
    search_path: tuple[Path, ...],
    withdraw: bool,
    show: bool,
    journal: str | None,
    by: str | None,
    output: str,
) -> None:
    """Approve a mission: exactly the content that its files and drawings have now.

    Where the fleet file asks for approvals, a mission starts only when enough persons other than
    who edited it last have approved it. Any change of it needs approvals anew.
    """
    from m2pem.api.operator import operator_name
    from m2pem.executive.loading import load_source
    from m2pem.fleet.fleet_file import load_fleet

    if withdraw and show:
        raise click.UsageError("--withdraw changes what --show shows: give one of both")
    method = "withdraw_approval" if withdraw else "approval" if show else "approve"
    loaded, fleet = load_source(mission, search_path), load_fleet(fleet_file)
    name = by or operator_name()
    socket = _executive(journal_file(journal), fleet)
    if socket is not None:
        state = _asked(socket, method, loaded, name)
    else:
        state = asyncio.run(_written(journal, method, loaded, fleet, name))
    if output == "json":
        click.echo(as_json({**_as_data(state)}))
    else:
        click.echo(str(state))


def _as_data(state: "MissionApproval") -> dict[str, object]:
    import msgspec

    data = msgspec.to_builtins(state)
    return {**data, "needed": state.needed, "missing": state.missing, "may_start": state.may_start}


def _executive(journal: Path, fleet: "Fleet") -> Path | None:
    """Return an executive on the journal which serves a fleet of this name, and asks for approvals:
    one that simulates everything asks for none."""
    from base64 import b64decode

    from m2pem.control_socket.client import ask
    from m2pem.control_socket.paths import live_sockets
    from m2pem.fleet.fleet import restore

    for path in live_sockets(journal):
        served = restore(b64decode(ask(path, "fleet")))
        if served.name == fleet.name and served.approval_persons:
            return path
    return None


def _asked(socket: Path, method: str, mission: "Mission", by: str) -> "MissionApproval":
    import msgspec

    from m2pem.api.approval import MissionApproval
    from m2pem.api.operations import mission_files
    from m2pem.control_socket.client import LONG_TIMEOUT_S, ask

    who = {} if method == "approval" else {"by": by}
    sent = ask(socket, method, timeout_s=LONG_TIMEOUT_S, mission=mission_files(mission), **who)
    return msgspec.convert(sent, MissionApproval)


async def _written(
    journal_url: str | None, method: str, mission: "Mission", fleet: "Fleet", by: str
) -> "MissionApproval":
    """No executive serves the fleet here: write to the journal, which the next one reads."""
    from m2pem.cli.journals import journal_at, url_of
    from m2pem.executive.approvals import Approvals
    from m2pem.executive.drawings import Drawings

    def now_us() -> int:
        return time.time_ns() // 1000

    async with journal_at(url_of(journal_url)) as journal:
        drawings = Drawings(fleet, journal, now_us)
        await drawings.load()
        approvals = Approvals(
            fleet,
            journal,
            lambda: {**fleet.geometries, **drawings.geometries},
            lambda: drawings.drawn_by,
            now_us,
        )
        files = mission.file, mission.source, mission.library
        match method:
            case "approve":
                return await approvals.approve(*files, by)
            case "withdraw_approval":
                return await approvals.withdraw(*files, by)
        return await approvals.state(*files)
