"""One question to a running executive, for commands that ask and end."""

import socket
from base64 import b64decode
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from m2pem.control_socket.paths import ControlSocketError, address, live_sockets
from m2pem.control_socket.protocol import Request, line, result_of
from m2pem.errors import M2pemError, NotDrivenError, OperatorError
from m2pem.fleet.fleet import restore

TIMEOUT_S = 10.0
LONG_TIMEOUT_S = 600.0
"""For what reads and checks a mission: it may be large."""


def ask(path: Path, method: str, *, timeout_s: float = TIMEOUT_S, **params: Any) -> Any:
    """Call a method of the executive that listens at `path`.

    Raises:
        OperatorError: it refused.
        ControlSocketError: it is gone, or does not answer.
    """
    with socket.socket(socket.AF_UNIX) as caller:
        caller.settimeout(timeout_s)
        try:
            with address(path) as there:
                caller.connect(there)
            caller.sendall(line(Request("2.0", method, params, id=1)))
            with caller.makefile("rb") as answers:
                return result_of(answers.readline())
        except OSError as error:
            raise ControlSocketError(f"the executive at {path} does not answer: {error}") from error


def ask_driver(journal: Path, run: str, method: str, **params: Any) -> Any:
    """Call a method of the executive that drives `run`, among those on the journal.

    Raises:
        OperatorError: it refused, or none drives the run.
        ControlSocketError: it is gone, or does not answer.
    """
    elsewhere: list[str] = []
    for path in live_sockets(journal):
        try:
            return ask(path, method, run=run, **params)
        except NotDrivenError as error:
            elsewhere.append(str(error))
    if elsewhere:
        raise NotDrivenError("; ".join(elsewhere))
    raise _not_driven(journal)


def ask_all(journal: Path, method: str, **params: Any) -> list[Any]:
    """Call a method that returns a list of every executive on the journal, at the same time.

    Raises:
        OperatorError: some refused or did not answer, each named; or there is none.
    """
    paths = executives(journal)
    answers: list[Any] = []
    problems: list[str] = []
    with ThreadPoolExecutor(len(paths)) as pool:
        asked = [pool.submit(ask, path, method, **params) for path in paths]
        for answer in asked:
            try:
                answers += answer.result()
            except M2pemError as error:
                problems.append(str(error))
    if problems:
        done = f"; done: {', '.join(map(str, answers))}" if answers else ""
        raise OperatorError(f"{'; '.join(problems)}{done}")
    return answers


def executives(journal: Path) -> list[Path]:
    """The sockets of all executives on the journal.

    Raises:
        NotDrivenError: there is none.
    """
    paths = list(live_sockets(journal))
    if not paths:
        raise _not_driven(journal)
    return paths


def find_executive(journal: Path, run: str | None) -> Path:
    """The socket of the executive that drives `run`; of the only one on the journal if None.

    Raises:
        NotDrivenError: there is none.
        OperatorError: without a run, there is more than one.
    """
    paths = executives(journal)
    if run is None:
        if len(paths) > 1:
            raise OperatorError(
                f"{len(paths)} executives write to {journal}: name a run of the one you mean"
            )
        return paths[0]
    elsewhere: list[str] = []
    for path in paths:
        try:
            ask(path, "mission_time_s", run=run)
        except NotDrivenError as error:
            elsewhere.append(str(error))
        except OperatorError:
            return path  # it drove the run to its end
        else:
            return path
    raise NotDrivenError("; ".join(elsewhere))


def choose_executive(journal: Path, name: str | None) -> Path:
    """The socket of the executive with that process id or fleet; None: of the only one.

    Raises:
        OperatorError: there is none; or several, which are listed.
    """
    paths = executives(journal)
    if name is None and len(paths) == 1:
        return paths[0]
    fleets = {path: fleet_name(path) for path in paths}
    chosen = [path for path, fleet in fleets.items() if name in (path.stem, fleet)]
    if len(chosen) == 1:
        return chosen[0]
    listed = ", ".join(f"{path.stem} with fleet {fleet}" for path, fleet in fleets.items())
    what = f"no executive {name!r}" if name and not chosen else f"{len(paths)} executives"
    raise OperatorError(
        f"{what} with the journal {journal}; running are {listed}. Say which: --run-on "
        f"{next(iter(fleets)).stem}"
    )


def fleet_name(path: Path) -> str:
    """The name of the fleet of the executive that listens at `path`.

    Raises:
        ControlSocketError: it is gone, or does not answer.
    """
    return restore(b64decode(ask(path, "fleet"))).name


def _not_driven(journal: Path) -> NotDrivenError:
    return NotDrivenError(
        f"no executive with the journal {journal} is running here: "
        "m2pem serve starts one; if it has another journal, name that with --journal"
    )
