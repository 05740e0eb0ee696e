"""`m2pem alerts`, `m2pem acknowledge` and `m2pem own`: what operators must know now."""

from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import as_json, example, format_option, journal_option
from m2pem.cli.run_control import by_option, executives_here

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from m2pem.api.alerts import OperatorAlert


@click.command(epilog=example("m2pem alerts"))
@click.option("--over", is_flag=True, help="Also those that are over, the newest first.")
@journal_option
@format_option
def alerts(over: bool, journal: str | None, output: str) -> None:
    """List what operators must know now.

    The alerts of all executives on this host, the most severe first, each with who has acknowledged
    it and who takes care.
    """
    from m2pem.api.description import printable

    found = [each for socket in executives_here(journal) for each in _of(socket, over=over)]
    if output == "json":
        click.echo(as_json({"alerts": found}))
    else:
        click.echo("\n".join(printable(str(each)) for each in found) or "there is no alert")


@click.command(epilog=example("m2pem acknowledge a3"))
@click.argument("alert_ids", metavar="[ALERT]...", nargs=-1)
@click.option("--all", "everything", is_flag=True, help="All that are not acknowledged.")
@journal_option
@by_option
def acknowledge(
    alert_ids: tuple[str, ...], everything: bool, journal: str | None, by: str | None
) -> None:
    """Note that you have seen alerts.

    They call no operator any more. What was said once is over then. What is still so, such as a
    lost link, stays in the list.
    """
    if everything == bool(alert_ids):
        raise click.UsageError("name alerts, or give --all")
    _steer(journal, "acknowledge_alert", alert_ids, "acknowledged", by)


@click.command(epilog=example("m2pem own a3"))
@click.argument("alert_ids", metavar="ALERT...", nargs=-1, required=True)
@click.option("--owner", metavar="NAME", help="Who takes care  [default: who asks].")
@click.option("--release", is_flag=True, help="Give it up: it has no owner any more.")
@journal_option
@by_option
def own(
    alert_ids: tuple[str, ...],
    owner: str | None,
    release: bool,
    journal: str | None,
    by: str | None,
) -> None:
    """Note who takes care of alerts."""
    if release and owner:
        raise click.UsageError("--release has no --owner")
    if release:
        _steer(journal, "own_alert", alert_ids, "given up", by, owner="")
    else:
        done = f"{owner or 'you'} take{'s' if owner else ''} care"
        more = {"owner": owner} if owner else {}
        _steer(journal, "own_alert", alert_ids, done, by, **more)


def _of(socket: "Path", *, over: bool = False) -> "Sequence[OperatorAlert]":
    import msgspec

    from m2pem.api.alerts import OperatorAlert
    from m2pem.control_socket.client import ask

    return msgspec.convert(ask(socket, "alerts", over=over), list[OperatorAlert])


def _steer(
    journal: str | None,
    method: str,
    alert_ids: "Sequence[str]",
    done: str,
    by: str | None,
    **params: Any,
) -> None:
    """Call a method for each alert, at the executive whose list has it; none named: all that
    call."""
    from m2pem.api.operator import operator_name
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import ask
    from m2pem.errors import OperatorError

    lists = {socket: _of(socket) for socket in executives_here(journal)}
    wanted = [
        (socket, alert.alert)
        for socket, found in lists.items()
        for alert in found
        if (alert.alert in alert_ids if alert_ids else alert.calls)
    ]
    known = [alert.alert for found in lists.values() for alert in found]
    for each in alert_ids:
        if each not in known:
            raise OperatorError(f"{each!r} is no open alert; open: {', '.join(known) or 'none'}")
        if known.count(each) > 1:
            raise OperatorError(f"several executives have an alert {each}: say which by --journal")
    for socket, alert_id in wanted:
        ask(socket, method, alert=alert_id, by=by or operator_name(), **params)
        note(f"{alert_id}: {done}")
    if not wanted:
        note("there is nothing to acknowledge")
