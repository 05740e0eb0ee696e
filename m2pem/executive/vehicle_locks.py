"""Locks that say which executive of this user commands a vehicle: one locked file for each address.

The kernel holds a lock for as long as its process lives: a killed executive locks nothing.
"""

import fcntl
import hashlib
import json
import os
import shlex
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from m2pem.errors import M2pemError
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.runtime_directory import VARIABLE, runtime_directory
from m2pem.fleet.fleet import SIMULATED
from m2pem.journal.postgres_address import without_password
from m2pem.mission.catalogue import ResourceId


class VehicleInUseError(M2pemError):
    """Another executive commands a vehicle of the fleet."""

    exit_status = 2


class VehicleLocks:
    """The locks of one executive. `addresses`: of each vehicle or payload; see `addresses_of`.

    `journal`: its file, beside which the executive is found; None: it is in memory.
    """

    def __init__(
        self, addresses: Mapping[ResourceId, Iterable[str]], journal: Path | None = None
    ) -> None:
        self._addresses = addresses
        self._journal = journal
        self._held: dict[Path, int] = {}

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
            "command": without_password(shlex.join(_command())),
            "address": address,
            "journal": str(self._journal or ""),
        }
        os.ftruncate(file, 0)
        os.pwrite(file, json.dumps(me).encode(), 0)
        return None


def addresses_of(arbiters: FleetArbiters, journal: Path | None) -> dict[ResourceId, list[str]]:
    """What must have one executive only, for each vehicle and payload.

    A real one is known by its arbiter and what that connects to. A simulated one is what its state
    file says it is; the vehicles of a fleet with one journal count as the same, whichever file
    they are in. One without a state file exists in this process alone.
    """
    found: dict[ResourceId, list[str]] = {}
    for resource, (arbiter, own) in arbiters.addresses().items():
        addresses = [f"{arbiter}: {each}" for each in own]
        if arbiter == SIMULATED and addresses and journal is not None:
            addresses.append(f"{journal.resolve()}: {arbiters.fleet.name}: {resource}")
        found[resource] = addresses
    return found


def _is_at(file: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except FileNotFoundError:
        return False


def _command() -> list[str]:
    program = Path(sys.argv[0])
    name = "m2pem" if program.name in ("m2pem", "__main__.py") else str(program)
    return [name, *sys.argv[1:]]


def _refusal(holder: str) -> str:
    """Who has a vehicle, of what the holder of its lock has written, and what to do."""
    try:
        read = json.loads(holder)
        pid, command, journal = int(read["pid"]), str(read["command"]), read.get("journal")
    except (ValueError, KeyError, TypeError):
        return "another executive commands it, which has just begun; try again"
    start = "Start the mission there"
    if journal:
        start += f" (m2pem start MISSION --journal {shlex.quote(journal)} --run-on {pid})"
    return (
        f"process {pid} commands it already: {command}; one executive commands a vehicle. {start}, "
        f"or end that one first: kill {pid} (it stops its missions and releases its vehicles)"
    )
