"""`m2pem answer`, `signal`, `pause`, `continue` and `stop`: one request to a running executive."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import (
    example,
    journal_option,
    optional_run_argument,
    run_argument,
    signal_data_option,
)

if TYPE_CHECKING:
    from m2pem.errors import NotDrivenError, OperatorError
    from m2pem.mission.values import Value

by_option = click.option(
    "--by", metavar="NAME", help="Who asks, for the journal  [default: user@host]"
)


def steer(
    journal_url: str | None, run: str, method: str, by: str | None, done: str, **params: Any
) -> None:
    """Call a method of the executive that drives the run; then note what was `done`.

    Raises:
        OperatorError, UnusableError: as `ask_driving`.
    """
    from m2pem.cli.notes import note

    ask_of_run(journal_url, run, method, by, **params)
    note(done)


def ask_of_run(
    journal_url: str | None, run: str, method: str, by: str | None, **params: Any
) -> Any:
    """Call a method of the executive that drives the run, as `ask_driving`, and say who asks."""
    from m2pem.api.operator import operator_name

    return ask_driving(journal_url, run, method, by=by or operator_name(), **params)


def ask_driving(journal_url: str | None, run: str, method: str, **params: Any) -> Any:
    """Call a method of the executive that drives the run, and return the result.

    Raises:
        OperatorError: it refused, or none drives the run; then, what the run has left behind.
        UnusableError: the journal is in memory.
    """
    from m2pem.control_socket.client import ask_driver
    from m2pem.errors import NotDrivenError

    path = journal_file(journal_url)
    try:
        return ask_driver(path, run, method, **params)
    except NotDrivenError as error:
        raise explain(error, journal_url, path, method, run) from error


def explain(
    error: "NotDrivenError", journal_url: str | None, path: Path, method: str, run: str
) -> "OperatorError":
    """Return an error that says what the journal knows of a run that no executive here drives: how
    and when it has ended, which other host drives it, or what it has left behind.

    `path`: the file of the journal.
    """
    from m2pem.errors import NotDrivenError, OperatorError

    if ended := _ended(journal_url, path, method, run):
        return OperatorError(ended)
    if there := elsewhere(journal_url, run):
        return NotDrivenError(there)
    return NotDrivenError(f"{error}{_left_behind(journal_url, path, run)}")


def steer_all(journal_url: str | None, method: str, by: str | None, **params: Any) -> list[str]:
    """Call a method of every executive on the journal, all at once; returns their answers together.

    Raises:
        OperatorError: an executive refused, or there is none.
        UnusableError: the journal is in memory.
    """
    from m2pem.api.operator import operator_name
    from m2pem.control_socket.client import ask_all
    from m2pem.errors import NotDrivenError

    path = journal_file(journal_url)
    try:
        with found_elsewhere(journal_url):
            return ask_all(path, method, by=by or operator_name(), **params)
    except NotDrivenError as error:
        raise NotDrivenError(f"{error}{_left_behind(journal_url, path)}") from error


def held_schedules(journal: Path) -> list[str]:
    """Who holds the schedule of each executive on the journal; "": no operator."""
    from m2pem.control_socket.client import ask
    from m2pem.control_socket.paths import live_sockets
    from m2pem.errors import M2pemError

    found = []
    for path in live_sockets(journal):
        with suppress(M2pemError):  # the stop is what matters
            found.append(str(ask(path, "scheduled")["hold"]))
    return found


def _ended(journal_url: str | None, path: Path, request: str, run: str) -> str:
    """How and when a run has ended, by the journal; "" if it has not, or is not known."""
    from m2pem.cli.journals import find_run, journal_to_read
    from m2pem.errors import M2pemError
    from m2pem.executive.ended_runs import describe_end

    async def found() -> str:
        async with journal_to_read(journal_url) as journal:
            line = await find_run(journal, run)
        return describe_end(request, run, line) if line.outcome is not None else ""

    if path.exists():
        with suppress(M2pemError):  # what the executive refused matters more
            return asyncio.run(found())
    return ""


def elsewhere(journal_url: str | None, run: str | None = None) -> str:
    """Return which other host drives a run, or (None) which ones serve on a journal in PostgreSQL,
    and what to do; "": none."""
    from m2pem.cli.journals import executives_elsewhere

    said = []
    for each in executives_elsewhere(journal_url):
        if run is None:
            what = ", ".join(each.fleets) or "this journal"
            said.append(f"{each.host} serves {what} ({each})")
        elif run in each.runs:
            said.append(f"{each.host} drives {run} ({each})")
    return f"{'; '.join(said)}: run the command there" if said else ""


@contextmanager
def found_elsewhere(journal_url: str | None) -> Iterator[None]:
    """Within the block, the error that no executive is here says which other host has one."""
    from m2pem.errors import NotDrivenError

    try:
        yield
    except NotDrivenError as error:
        if there := elsewhere(journal_url):
            raise NotDrivenError(there) from error
        raise


def executives_here(journal_url: str | None) -> list[Path]:
    """Return the sockets of the executives of this host on the journal; a note names the others.

    Raises:
        NotDrivenError: there is none here.
    """
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import executives

    with found_elsewhere(journal_url):
        found = executives(journal_file(journal_url))
    if there := elsewhere(journal_url):
        note(f"also {there}")
    return found


def _left_behind(journal_url: str | None, path: Path, run: str | None = None) -> str:
    """Lines on what interrupted runs have left behind: that of `run`, or (None) all."""
    from m2pem.cli.journals import interrupted_runs
    from m2pem.errors import M2pemError

    left = []
    if path.exists():
        with suppress(M2pemError):  # what the executive refused matters more
            left = asyncio.run(interrupted_runs(journal_url))
    return "".join(f"\n{each.as_text()}" for each in left if run in (None, each.run))


def journal_file(journal_url: str | None) -> Path:
    """The file of a journal, beside which its executives are found.

    Raises:
        UnusableError: the journal is in memory.
    """
    from m2pem.cli.journals import url_of
    from m2pem.cli.options import UnusableError
    from m2pem.journal import file_of

    path = file_of(url_of(journal_url))
    if path is None:
        raise UnusableError("a journal in memory has no place where its executive could be found")
    return path


@click.command(epilog=example("m2pem answer r1 p2 continue"))
@run_argument
@click.argument("prompt")
@click.argument("decision")
@journal_option
@by_option
def answer(run_id: str, prompt: str, decision: str, journal: str | None, by: str | None) -> None:
    """Answer a prompt of a run that is running on this host.

    The first answer wins; a later one ends with 1.
    """
    done = f"{run_id}: {prompt} is answered: {decision}"
    steer(journal, run_id, "answer", by, done, prompt=prompt, decision=decision)


@click.command(epilog=example("m2pem signal r1 'Stop driving'"))
@run_argument
@click.argument("signal_id", metavar="SIGNAL")
@signal_data_option
@journal_option
@by_option
def signal(
    run_id: str, signal_id: str, data: "dict[str, Value]", journal: str | None, by: str | None
) -> None:
    """Send a signal to a run that is running on this host.

    SIGNAL is its id, or its name.
    """
    done = f"{run_id}: signal {signal_id!r} is sent"
    steer(journal, run_id, "signal", by, done, id=signal_id, data=data)


@click.command(epilog=example("m2pem note r1 'wind picks up'"))
@run_argument
@click.argument("text")
@journal_option
@by_option
def note(run_id: str, text: str, journal: str | None, by: str | None) -> None:
    """Write a note into the log of a run that is running on this host.

    Every operator sees it, and the journal keeps it with your name.
    """
    steer(journal, run_id, "add_note", by, f"{run_id}: the note is written", text=text)


@click.command(epilog=example("m2pem pause r1"))
@run_argument
@journal_option
@by_option
def pause(run_id: str, journal: str | None, by: str | None) -> None:
    """Pause a run that is running on this host.

    Its vehicles hold, and its timers stand.
    """
    steer(journal, run_id, "pause", by, f"{run_id} is paused")


@click.command("continue", epilog=example("m2pem continue r1"))
@run_argument
@journal_option
@by_option
def continue_(run_id: str, journal: str | None, by: str | None) -> None:
    """Let a run on this host go on after a pause."""
    steer(journal, run_id, "resume", by, f"{run_id} goes on")


@click.command(epilog=example("m2pem stop r1 --reason 'people on the road'"))
@optional_run_argument
@click.option("--all", "every", is_flag=True, help="Every run of the journal that is running.")
@click.option("--reason", default="", help="Why, for the journal.")
@journal_option
@by_option
def stop(run_id: str | None, every: bool, reason: str, journal: str | None, by: str | None) -> None:
    """Stop a run that is running on this host, or all of them.

    Its vehicles are sent the command to stop, and its tokens end.
    """
    if every == (run_id is not None):
        raise click.UsageError("name a run to stop, or --all")
    from m2pem.errors import OperatorError

    if run_id is not None:
        steer(journal, run_id, "stop", by, f"stopped: {run_id}", reason=reason)
        return
    stopped = steer_all(journal, "stop_all", by, reason=reason)
    click.echo(f"stopped: {', '.join(stopped) or 'no run was running'}")
    if any(hold for hold in held_schedules(journal_file(journal))):
        click.echo("the schedule is held; `m2pem schedule release` lets it go on")
    if there := elsewhere(journal):
        raise OperatorError(f"what other hosts have is not stopped: {there}")
