"""The checks of `m2pem doctor` that need no plugin: what a host must have for an executive."""

import asyncio
import ctypes
import errno
import os
import platform
import resource
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import m2pem
from m2pem.api.health import HealthCheck, HealthStatus
from m2pem.control_socket.paths import folder_of, live_sockets
from m2pem.errors import FleetError, M2pemError
from m2pem.executive.runtime_directory import VARIABLE, runtime_directory
from m2pem.journal import default_url, file_of, is_postgres, open_journal
from m2pem.journal.storage_checks import (
    MIN_FREE_VARIABLE,
    free_space_mb,
    min_free_mb,
    space_shortage,
)

if TYPE_CHECKING:
    from m2pem.fleet.fleet import Fleet, Payload, Vehicle
    from m2pem.journal.fleet_server import FleetServer
    from m2pem.plugins import PluginManager

OK, WARNING, ERROR = HealthStatus.OK, HealthStatus.WARNING, HealthStatus.ERROR

MIN_OPEN_FILES = 1024
"""Each vehicle, page and attached operator has sockets, and SQLite has files."""

NETWORK_FILE_SYSTEMS = {"9p", "afs", "ceph", "cifs", "fuse.sshfs", "ncpfs", "nfs", "nfs4", "smb3"}
"""SQLite's locks and shared memory do not work there: two executives could damage a journal."""


def check_host(plugins: "PluginManager", journal_url: str | None) -> Iterator[HealthCheck]:
    """Check what every executive needs: Python, plugins, folders, disk, clock, open files."""
    version = f"m2pem {m2pem.__version__}, Python {platform.python_version()} in {sys.prefix}"
    yield HealthCheck("python", OK, version)
    yield from check_plugins(plugins)
    yield from check_journal(journal_url)
    yield check_runtime_folder()
    yield check_clock()
    yield check_open_files()


def check_plugins(plugins: "PluginManager") -> Iterator[HealthCheck]:
    """Check that every installed plugin can be loaded."""
    listing = plugins.listing()
    for broken in plugins.failures:
        remedy = f"install it for m2pem {m2pem.__version__}, or remove it"
        yield HealthCheck(f"plugin {broken.name}", WARNING, str(broken), remedy)
    well = [each.name for each in listing if each.provides and each.distribution != "m2pem"]
    yield HealthCheck("plugins", OK, ", ".join(well) or "only those of m2pem itself")


def check_journal(url: str | None) -> Iterator[HealthCheck]:
    """Check the journal's folder, its files, its free space, and the executives that write to it.

    `url`: None means the user's own journal.
    """
    try:
        path = file_of(url or default_url())
    except M2pemError as error:
        yield HealthCheck("journal", ERROR, str(error), "name another journal by --journal")
        return
    if path is None:
        remedy = "name a path by --journal to resume runs after a crash"
        yield HealthCheck("journal", WARNING, "it is in memory: a crash loses all runs", remedy)
        return
    path = path.absolute()
    problem = _folder_problem(path.parent) or _file_problem(path)
    if problem is None and is_postgres(url or ""):
        problem = _server_problem(url or "")
    if problem is not None:
        yield problem
        return
    yield HealthCheck("journal", OK, f"{path} can be written")
    yield _disk(path)
    yield _control(path)


def _server_problem(url: str) -> HealthCheck | None:
    try:
        journal = open_journal(url)
    except M2pemError as error:
        return HealthCheck("journal", ERROR, str(error), "mend the cause, or use another journal")
    asyncio.run(journal.close())
    return None


def _folder_problem(folder: Path) -> HealthCheck | None:
    user = f"user {os.geteuid()}"
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(4096))
            file.flush()
            os.fsync(file.fileno())
    except FileNotFoundError:
        return HealthCheck(
            "journal", ERROR, f"there is no folder {folder}", f"mkdir -m 700 -p {folder}"
        )
    except OSError as error:
        remedies = {
            errno.EROFS: "mount a writable volume there, or name another folder by --journal",
            errno.ENOSPC: "make room on its disk",
        }
        remedy = remedies.get(error.errno or 0, f"give it to {user}: chown {os.geteuid()} {folder}")
        why = f"{user} cannot write to {folder}: {error.strerror}"
        return HealthCheck("journal", ERROR, why, remedy)
    try:
        mounts = Path("/proc/self/mounts").read_text(encoding="utf-8", errors="replace")
    except OSError:
        mounts = ""
    if (system := file_system(folder, mounts)) in NETWORK_FILE_SYSTEMS:
        why = f"{folder} is on a network file system ({system}), where SQLite's locks do not hold"
        return HealthCheck("journal", ERROR, why, "keep the journal on a disk of this host")
    mode = folder.stat().st_mode
    if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
        why = f"every user may remove the files of {folder}"
        return HealthCheck("journal", ERROR, why, f"chmod o-w {folder}")
    return None


def _file_problem(path: Path) -> HealthCheck | None:
    for file in sorted(path.parent.glob(f"{path.name}*")):
        if file.is_file() and not os.access(file, os.R_OK | os.W_OK):
            why = f"user {os.geteuid()} may not read and write {file}"
            return HealthCheck("journal", ERROR, why, f"chown {os.geteuid()} {path}*")
    return None


def file_system(folder: Path, mounts: str) -> str:
    """Return the type of the file system that a folder is on; "" if it is not known.

    `mounts`: lines of /proc/self/mounts. Of those at the same place, the last one is seen.
    """
    here, longest, system = folder.resolve(), "", ""
    for line in mounts.splitlines():
        _, where, kind, *_ = line.split(" ")
        point = where.replace("\\040", " ")
        if here.is_relative_to(point) and len(point) >= len(longest):
            longest, system = point, kind
    return system


def _disk(path: Path) -> HealthCheck:
    try:
        bound = min_free_mb()
        shortage = space_shortage(path)
        free = free_space_mb(path)
    except (M2pemError, OSError) as error:
        return HealthCheck("disk", ERROR, str(error), f"correct {MIN_FREE_VARIABLE}, or the disk")
    if shortage:
        remedy = "remove what is not needed, or keep the journal on another disk"
        return HealthCheck("disk", ERROR, shortage, remedy)
    if not os.statvfs(path.parent).f_favail and os.statvfs(path.parent).f_files:
        return HealthCheck("disk", ERROR, "it has no free inode", "remove files that are not used")
    return HealthCheck("disk", OK, f"{free:.0f} MB are free; runs begin with {bound:g} MB or more")


def _control(path: Path) -> HealthCheck:
    folder = folder_of(path)
    if folder.is_symlink() or (folder.exists() and folder.lstat().st_uid != os.geteuid()):
        why = f"{folder} does not belong to this user: m2pem start and stop reach no executive"
        return HealthCheck("control socket", ERROR, why, f"remove {folder}")
    running = ", ".join(socket.stem for socket in live_sockets(path))
    found = f"processes that serve this journal: {running}" if running else "no executive serves"
    return HealthCheck("control socket", OK, found)


def check_runtime_folder() -> HealthCheck:
    """Check that the folder of locks is this user's own, and that no other user can change it."""
    name = "runtime folder"
    try:
        folder = runtime_directory()
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        why = f"{error.filename}: {error.strerror}: the locks of vehicles cannot be kept there"
        return HealthCheck(name, ERROR, why, f"name a folder of your own by {VARIABLE}")
    mode = stat.S_IMODE(folder.stat().st_mode)
    if mode & 0o077:
        why = f"{folder} has mode {mode:04o}: other users can see or remove the locks of vehicles"
        return HealthCheck(name, ERROR, why, f"chmod 700 {folder}")
    return HealthCheck(name, OK, f"{folder} is this user's own")


class Timex(ctypes.Structure):
    """The beginning of `struct timex` (adjtimex(2)), as long as the whole."""

    _fields_ = (
        ("modes", ctypes.c_uint),
        ("offset", ctypes.c_long),
        ("freq", ctypes.c_long),
        ("maxerror", ctypes.c_long),
        ("esterror", ctypes.c_long),
        ("status", ctypes.c_int),
        ("rest", ctypes.c_long * 32),
    )


_STA_UNSYNC = 0x0040


def clock_is_synchronised() -> bool | None:
    """Whether the kernel says that a time service keeps the clock right; None: it does not say."""
    timex = Timex()  # modes 0: it is only read
    try:
        state = ctypes.CDLL(None, use_errno=True).adjtimex(ctypes.byref(timex))
    except (OSError, AttributeError):
        return None
    return None if state < 0 else not timex.status & _STA_UNSYNC


def check_clock() -> HealthCheck:
    """Check that the clock is synchronised: timers at dates and the journal's times depend on it.

    Vehicles, too: what a ROS node stamped in the future or long ago is not used.
    """
    remedy = "install chrony or systemd-timesyncd; `timedatectl` shows whether it has a server"
    match clock_is_synchronised():
        case True:
            return HealthCheck("clock", OK, "it is synchronised")
        case False:
            return HealthCheck("clock", WARNING, "no time service synchronises it", remedy)
        case None:
            why = "the kernel does not say whether it is synchronised"
            return HealthCheck("clock", WARNING, why, remedy)


def check_open_files() -> HealthCheck:
    """Check the limit of open files."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY or soft >= MIN_OPEN_FILES:
        return HealthCheck("open files", OK, f"up to {soft if soft >= 0 else 'any number'}")
    how = "" if hard == resource.RLIM_INFINITY or hard >= MIN_OPEN_FILES else " (as root)"
    return HealthCheck(
        "open files",
        WARNING,
        f"a process may open {soft}; {MIN_OPEN_FILES} are enough",
        f"ulimit -n {MIN_OPEN_FILES}{how}, or LimitNOFILE of the systemd unit",
    )


def check_fleet(
    file: str, plugins: "PluginManager", journal_url: str | None
) -> "tuple[list[HealthCheck], Fleet | None]":
    """Check that the fleet can be loaded, its arbiters exist, and no executive has its vehicles.

    The fleet is None if it cannot be used.
    """
    from m2pem.executive.vehicle_locks import VehicleInUseError, VehicleLocks, addresses_of
    from m2pem.fleet.fleet_file import load_fleet
    from m2pem.scripting.sources import arbiters_of

    try:
        fleet = load_fleet(file)
    except FleetError as error:
        return _findings(error, file), None
    checks = list(_arbiters(fleet, plugins))
    if any(each.status is ERROR for each in checks):
        return checks, fleet
    try:
        arbiters = arbiters_of(fleet, plugins)
    except FleetError as error:
        return [*checks, *_findings(error, file)], fleet
    except M2pemError as error:
        return [*checks, HealthCheck("fleet", ERROR, str(error), f"correct {file}")], fleet
    checks.append(HealthCheck("fleet", OK, f"{file} can be used"))
    try:
        journal = file_of(journal_url or default_url())
        locks = VehicleLocks(addresses_of(arbiters), journal)
        locks.acquire()
        locks.release()
    except VehicleInUseError as error:
        remedy = "start missions there (m2pem start), or end that process first"
        checks.append(HealthCheck("vehicles", WARNING, str(error), remedy))
        checks += [each for each in _served(fleet, journal_url) if each.name == "standby"]
    except M2pemError:
        pass  # the check of the journal says it
    else:
        checks += _served(fleet, journal_url)
    return checks, fleet


def _served(fleet: "Fleet", journal_url: str | None) -> Iterator[HealthCheck]:
    """Say which executives serve the fleet on the journal, and stand by for it, on any host."""
    from m2pem.cli.journals import journal_to_read
    from m2pem.journal.standbys import standbys_of

    async def ask() -> "tuple[FleetServer | None, list[FleetServer], float | None]":
        async with journal_to_read(journal_url) as journal:
            server = await journal.fleet_server(fleet.name, [*fleet.vehicles, *fleet.payloads])
            return server, await standbys_of(journal, fleet.name), journal.lease_s

    try:
        server, standbys, lease_s = asyncio.run(ask())
    except M2pemError:
        return  # the check of the journal says it
    if server is not None:
        text = f"{server} serves {fleet.name}"
        if server.left_s is not None:
            text += f"; its lease lasts {server.left_s:.1f} s more ({lease_s:g} s are set here)"
        remedy = "start missions there (m2pem start), or let another one stand by: serve --standby"
        yield HealthCheck("vehicles", WARNING, text, remedy)
    else:
        yield HealthCheck("vehicles", OK, "no executive of this user commands them")
    who = "; ".join(map(str, standbys))
    yield HealthCheck("standby", OK, f"{who} stands by" if who else "no executive stands by")


def _findings(error: FleetError, file: str) -> list[HealthCheck]:
    texts = [str(each) for each in error.findings] or [str(error)]
    return [HealthCheck("fleet", ERROR, text, f"m2pem fleet {file}") for text in texts]


def _arbiters(fleet: "Fleet", plugins: "PluginManager") -> Iterator[HealthCheck]:
    served: dict[str, list[str]] = {}
    everything: list[Vehicle | Payload] = [*fleet.vehicles.values(), *fleet.payloads.values()]
    for each in everything:
        served.setdefault(each.arbiter, []).append(each.id)
    for name, resources in served.items():
        try:
            plugins.arbiter(name)
        except M2pemError as error:
            remedy = "install its plugin into the environment of m2pem; `m2pem plugins` lists all"
            yield HealthCheck(f"arbiter {name}", ERROR, str(error), remedy)
        else:
            yield HealthCheck(f"arbiter {name}", OK, f"serves {', '.join(resources)}")
