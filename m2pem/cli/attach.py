"""`m2pem attach`: one more operator of a running executive, from another terminal."""

import asyncio
import logging
from collections.abc import Sequence
from contextlib import AsyncExitStack, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.journals import executives_elsewhere, url_of
from m2pem.cli.options import (
    example,
    journal_option,
    ocu_option,
    optional_run_argument,
    path_option,
)
from m2pem.cli.run_control import explain, found_elsewhere, journal_file
from m2pem.journal import is_postgres

if TYPE_CHECKING:
    from m2pem.api.control import MissionControl
    from m2pem.api.health import ExecutiveAddress
    from m2pem.cli.ocus import Operators
    from m2pem.control_socket.remote import RemoteControl

log = logging.getLogger("m2pem.attach")

TAKEN_OVER_WITHIN_S = 3.0
"""By a standby of this host, after the executive has died; of another one, when the lease on the
journal has ended, too."""

LOOK_EACH_S = 0.2

ASK_EACH_S = 1.0
"""Between two questions to the executive, whether it is still there."""

SILENT_AFTER_S = 3.0
"""An executive that has not answered by then is stopped or blocked."""


@click.command(epilog=example("m2pem attach r1"))
@optional_run_argument
@journal_option
@ocu_option
@path_option
def attach(
    run_id: str | None,
    journal: str | None,
    ocu_names: str | None,
    search_path: tuple[Path, ...],
) -> None:
    """Serve an operator of an executive that is running on this host.

    RUN selects the executive, when several write to the journal. All its operators see the same
    and may do the same; missions go on when this one leaves. The files of missions that it starts
    are read here, and sent. When another executive of this host has taken over, it goes on there.
    """
    asyncio.run(_attach(run_id, journal, ocu_names, search_path))


async def _attach(
    run: str | None, journal_url: str | None, ocu_names: str | None, search_path: tuple[Path, ...]
) -> None:
    from m2pem.cli.notes import note
    from m2pem.cli.ocus import Operators, chosen
    from m2pem.control_socket.client import find_executive
    from m2pem.errors import NotDrivenError, OperatorError
    from m2pem.plugins import PluginManager

    path = journal_file(journal_url)
    plugins = PluginManager()
    units = chosen(ocu_names, plugins)
    try:
        with found_elsewhere(journal_url) if run is None else nullcontext():
            executive = await asyncio.to_thread(find_executive, path, run)
    except NotDrivenError as error:
        if run is None:
            raise
        raise await asyncio.to_thread(explain, error, journal_url, path, "attach", run) from error
    following: Path | None = executive
    while following is not None:
        operators = Operators(units, plugins)
        found = await _serve_at(following, operators, path, journal_url, search_path)
        if isinstance(found, str):
            raise OperatorError(found)
        if found is not None:
            note(f"m2pem: process {found.stem} has taken over from process {following.stem}")
        following = found


async def _serve_at(
    executive: Path,
    operators: "Operators",
    journal: Path,
    journal_url: str | None,
    search_path: tuple[Path, ...],
) -> Path | str | None:
    """Serve until the operators have left; returns the executive that has taken over before, or
    where it is."""
    from m2pem.api.runs import RunStatus
    from m2pem.cli.notes import note
    from m2pem.cli.session import what_goes_on
    from m2pem.control_socket.client import TIMEOUT_S
    from m2pem.control_socket.paths import ControlSocketError
    from m2pem.control_socket.remote import RemoteControl
    from m2pem.errors import OperatorError
    from m2pem.executive.loading import load_source

    remote = RemoteControl(executive, partial(load_source, search_path=search_path))
    async with AsyncExitStack() as stack:
        try:
            async with asyncio.timeout(TIMEOUT_S):
                control = await stack.enter_async_context(remote)
        except TimeoutError as error:
            raise OperatorError(silence(executive, ())) from error
        successor = Successor(
            remote, control, executive, journal, journal_url, repeats=operators.take_terminal
        )
        await successor.ask()
        who = ", ".join(map(str, successor.standbys)) or "no executive"
        note(f"m2pem: attached to process {executive.stem}; {who} stands by")
        operators.begin(control, lambda: None)
        left = asyncio.create_task(operators.left())
        looking = asyncio.create_task(successor.found())
        try:
            await asyncio.wait((left, looking), return_when=asyncio.FIRST_COMPLETED)
            if not left.done():
                return looking.result()
        finally:
            looking.cancel()
            await operators.end()
        with suppress(ControlSocketError, TimeoutError):  # the executive has ended, or is silent
            async with asyncio.timeout(SILENT_AFTER_S):
                runs = await control.runs()
            driven = (RunStatus.RUNNING, RunStatus.PAUSED)
            running = [each.run for each in runs if each.status in driven]
            note(what_goes_on(running, journal, serves=not running))
    return None


class Successor:
    """Finds the executive that takes over from the one that operators are attached to.

    `standbys`: those of its fleet. `repeats`: whether what is said of a silent executive is said
    again and again, as on a screen.
    """

    def __init__(
        self,
        remote: "RemoteControl",
        control: "MissionControl",
        executive: Path,
        journal: Path,
        journal_url: str | None,
        *,
        repeats: bool,
    ) -> None:
        self._remote = remote
        self._control = control
        self._executive = executive
        self._journal = journal
        self._url = journal_url
        self._repeats = repeats
        self.standbys: Sequence[ExecutiveAddress] = ()

    async def found(self) -> Path | str:
        """Wait until another executive serves the fleet, as this one has ended or is silent.

        Returns the socket of that one; for people, where it is, if that is another host.
        """
        gone = asyncio.create_task(self._remote.gone())
        silent = False
        try:
            while not gone.done():
                was_silent, silent = silent, not await self.ask()
                if silent and (other := await self._other()) is not None:
                    return other
                if silent and (self._repeats or not was_silent) and not gone.done():
                    log.warning("%s", silence(self._executive, self.standbys))
                elif was_silent and not silent:
                    log.warning("process %s answers again", self._executive.stem)
                await asyncio.wait((gone,), timeout=ASK_EACH_S)
        finally:
            gone.cancel()
        loop = asyncio.get_running_loop()
        until_s = loop.time() + self._taken_over_within_s()
        each_s = LOOK_EACH_S
        while (other := await self._other()) is None:
            if each_s == LOOK_EACH_S and loop.time() >= until_s:
                each_s = ASK_EACH_S
                log.warning(
                    "process %s, the executive, has ended, and no other one has taken over: STOP "
                    "from here reaches no vehicle. Use the vehicles' own stop; `m2pem serve` takes "
                    "up the runs that it has left",
                    self._executive.stem,
                )
            await asyncio.sleep(each_s)
        return other

    async def ask(self) -> bool:
        """Ask the executive who stands by; return whether it answers."""
        from m2pem.errors import M2pemError

        try:
            async with asyncio.timeout(SILENT_AFTER_S):
                await self._control.health()
        except (TimeoutError, M2pemError, OSError):
            return False
        with suppress(TimeoutError, M2pemError, OSError):  # its journal does not answer
            async with asyncio.timeout(SILENT_AFTER_S):
                self.standbys = await self._control.standbys()
        return True

    def _taken_over_within_s(self) -> float:
        if not is_postgres(url_of(self._url)):
            return TAKEN_OVER_WITHIN_S
        from m2pem.journal.lease import lease_s

        return TAKEN_OVER_WITHIN_S + lease_s()

    async def _other(self) -> Path | str | None:
        """Return which other executive serves the fleet: its socket, or where it is."""
        return await asyncio.to_thread(self._look)

    def _look(self) -> Path | str | None:
        from m2pem.control_socket.client import fleet_name
        from m2pem.control_socket.paths import live_sockets
        from m2pem.errors import M2pemError

        fleet = self._control.fleet().name
        for path in live_sockets(self._journal):
            with suppress(M2pemError):  # it is just ending
                if path != self._executive and fleet_name(path) == fleet:
                    return path
        for each in executives_elsewhere(self._url):
            if fleet in each.fleets:
                page = f": its page is {each.page}, or" if each.page else ":"
                return (
                    f"process {self._executive.stem} does not serve {fleet} any more. {each.host} "
                    f"serves it now ({each}){page} run `m2pem attach` there"
                )
        return None


def silence(executive: Path, standbys: "Sequence[ExecutiveAddress]") -> str:
    """Say that an executive does not answer, and what to do."""
    text = (
        f"process {executive.stem}, the executive, does not answer: STOP from here reaches no "
        "vehicle. Use the vehicles' own stop"
    )
    who = ", ".join(map(str, standbys))
    return f"{text}. `kill -9 {executive.stem}` lets {who} take over" if who else text
