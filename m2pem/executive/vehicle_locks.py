"""Locks that say which executive of this user commands a vehicle: one locked file for each address.

They exclude executives with other journals, or other fleets, on this host. That one executive alone
serves a fleet is for the journal to say: `Journal.serve_fleet`.

The kernel holds a lock for as long as its process lives: a killed executive locks nothing.
"""

import fcntl
import hashlib
import json
import os
import shlex
from collections.abc import Iterable, Mapping
from pathlib import Path

from m2pem.errors import M2pemError
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.runtime_directory import VARIABLE, runtime_directory
from m2pem.fleet.fleet import Fleet, digest_of
from m2pem.journal.base import Journal
from m2pem.journal.fleet_server import FleetServer, command_line
from m2pem.mission.catalogue import ResourceId


class VehicleInUseError(M2pemError):
    """Another executive commands a vehicle of the fleet."""

    exit_status = 2


class VehicleLocks:
    """The locks of one executive. `addresses`: of each vehicle or payload; see `addresses_of`.

    `journal`: its file, beside which the executive is found; None: it is in memory. `page`: the
    address of its web page, or "".
    """

    def __init__(
        self,
        addresses: Mapping[ResourceId, Iterable[str]],
        journal: Path | None = None,
        page: str = "",
    ) -> None:
        self._addresses = addresses
        self._journal = journal
        self._page = page
        self._held: dict[Path, int] = {}

    @property
    def resources(self) -> list[ResourceId]:
        """The vehicles and payloads that others may command, too."""
        return [resource for resource, addresses in self._addresses.items() if addresses]

    async def serve(self, journal: Journal, fleet: Fleet) -> None:
        """Let no other executive on the journal, on any host, serve these of the fleet.

        Raises:
            FleetServedError: another one does.
            JournalError: the journal cannot say or note it.
        """
        await journal.serve_fleet(fleet.name, self.resources, digest_of(fleet), self._page)

    def acquire(self) -> None:
        """Take the locks of all, or none.

        Raises:
            VehicleInUseError: another executive has some; the text names it, and how to end it.
        """
        taken: dict[str, list[ResourceId]] = {}
        try:
            for resource, addresses in self._addresses.items():
                for address in addresses:
                    holder = self._take(address)
                    if holder is not None:
                        taken.setdefault(_refusal(holder), []).append(resource)
        except OSError as error:
            self.release()
            raise VehicleInUseError(
                f"{error.filename}: {error.strerror}: the locks of vehicles cannot be kept there; "
                f"name another folder by {VARIABLE}"
            ) from error
        if taken:
            self.release()
            refusals = (f"{', '.join(dict.fromkeys(who))}: {why}" for why, who in taken.items())
            raise VehicleInUseError("\n".join(refusals))

    def release(self) -> None:
        """Give them back."""
        for path, file in self._held.items():
            path.unlink(missing_ok=True)
            os.close(file)
        self._held.clear()

    def _take(self, address: str) -> str | None:
        """Lock an address; returns what its holder has written, if another one has it."""
        path = runtime_directory() / f"{hashlib.sha256(address.encode()).hexdigest()[:32]}.lock"
        if path in self._held:
            return None
        while True:
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                text = os.pread(file, 100_000, 0).decode(errors="replace")
                os.close(file)
                return text
            if _is_at(file, path):
                break
            os.close(file)  # its holder has removed it meanwhile: a lock on it has no effect
        self._held[path] = file
        me = {
            "pid": os.getpid(),
            "command": command_line(),
            "address": address,
            "journal": str(self._journal or ""),
        }
        os.ftruncate(file, 0)
        os.pwrite(file, json.dumps(me).encode(), 0)
        return None


def addresses_of(arbiters: FleetArbiters) -> dict[ResourceId, list[str]]:
    """What must have one executive only, for each vehicle and payload.

    A real one is known by its arbiter and what that connects to. A simulated one is what its state
    file says it is. One without a state file exists in this process alone.
    """
    return {
        resource: [f"{arbiter}: {each}" for each in own]
        for resource, (arbiter, own) in arbiters.addresses().items()
    }


def refusal(server: FleetServer, journal: str) -> str:
    """Say who has a vehicle, and what to do. `journal`: what names its journal; "": in memory."""
    if not server.pid:
        return "another executive commands it, which has just begun; try again"
    where = "" if server.is_here else f" on {server.host}"
    start = "Start the mission there"
    if journal:
        option = f"--journal {shlex.quote(journal)} " if server.is_here else ""
        start += f" (m2pem start MISSION {option}--run-on {server.pid}{where and ','}{where})"
    return (
        f"process {server.pid}{where} commands it already: {server.command}; one executive "
        f"commands a vehicle. {start}, or end that one first: kill {server.pid}{where} (it stops "
        "its missions and releases its vehicles)"
    )


def _is_at(file: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except FileNotFoundError:
        return False


def _refusal(holder: str) -> str:
    """Who has a vehicle, of what the holder of its lock has written, and what to do."""
    try:
        read = json.loads(holder)
        server = FleetServer("", int(read["pid"]), str(read["command"]))
    except (ValueError, KeyError, TypeError):
        return refusal(FleetServer(), "")
    return refusal(server, str(read.get("journal") or ""))
