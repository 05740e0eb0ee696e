"""`m2pem doctor`: every check says what is right, or what to do."""

import asyncio
import ctypes
import json
import os
import resource
import signal
import socket
from pathlib import Path
from typing import Any

import pytest

from m2pem.api.health import HealthStatus, listening_check
from m2pem.cli import host_checks
from m2pem.executive.runtime_directory import VARIABLE
from m2pem.executive.vehicle_locks import VehicleLocks, addresses_of
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import open_journal
from m2pem.journal.standbys import StandbyNote, standbys_of
from m2pem.journal.storage_checks import MIN_FREE_VARIABLE
from m2pem.plugins import PluginManager
from m2pem.scripting.sources import arbiters_of
from m2pem.testing.contracts.journal_harness import opened
from tests.cli.conftest import Invoke
from tests.command_line import FLEET, CommandLine, fleet_with_state, install_plugin

Checks = dict[str, dict[str, str]]


@pytest.fixture(autouse=True)
def own_runtime_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "runtime"
    folder.mkdir(mode=0o700)
    monkeypatch.setenv(VARIABLE, str(folder))
    monkeypatch.setenv("M2PEM_BLOCK_PLUGINS", "all")
    return folder


def doctor(invoke: Invoke, *words: object) -> tuple[int, Checks]:
    """The exit status, and the checks by their names."""
    status, out, _ = invoke("doctor", "--format", "json", *words)
    said: dict[str, Any] = json.loads(out)
    assert said["ok"] is (status == 0)
    for check in said["checks"]:
        assert bool(check["remedy"]) is (check["status"] != "ok"), check
    return status, {check["name"]: check for check in said["checks"]}


def test_a_host_that_is_right_ends_with_0(invoke: Invoke) -> None:
    status, checks = doctor(invoke)
    assert status == 0
    assert [*checks] == [
        *("python", "plugins", "journal", "disk", "control socket", "runtime folder"),
        *("clock", "open files"),
    ]
    assert {check["status"] for name, check in checks.items() if name != "clock"} == {"ok"}


def test_people_read_the_remedy_below_the_check(invoke: Invoke, tmp_path: Path) -> None:
    status, out, _ = invoke("doctor", "--journal", tmp_path / "no" / "j.db")
    lines = out.splitlines()
    place = lines.index(f"error    journal         there is no folder {tmp_path}/no")
    assert lines[place + 1].strip() == f"mkdir -m 700 -p {tmp_path}/no"
    assert "; errors: 1, warnings: " in lines[-1]
    assert status == 1


def test_a_folder_that_takes_no_file_is_an_error(invoke: Invoke) -> None:
    status, checks = doctor(invoke, "--journal", "/sys/journal.db")
    assert (status, checks["journal"]["status"]) == (1, "error")
    assert "cannot write to /sys" in checks["journal"]["message"]
    assert "disk" not in checks


def test_a_folder_in_which_every_user_may_remove_files_is_an_error(
    invoke: Invoke, tmp_path: Path
) -> None:
    folder = tmp_path / "shared"
    folder.mkdir()
    folder.chmod(0o777)
    status, checks = doctor(invoke, "--journal", folder / "j.db")
    assert (status, checks["journal"]["remedy"]) == (1, f"chmod o-w {folder}")
    folder.chmod(0o1777)
    assert doctor(invoke, "--journal", folder / "j.db")[0] == 0


def test_a_journal_in_memory_is_a_warning(invoke: Invoke) -> None:
    status, checks = doctor(invoke, "--journal", "memory:")
    assert (status, checks["journal"]["status"]) == (0, "warning")


def test_a_journal_that_nothing_opens_is_an_error(invoke: Invoke) -> None:
    status, checks = doctor(invoke, "--journal", "mysql://host/j")
    assert (status, checks["journal"]["status"]) == (1, "error")


@pytest.mark.parametrize(
    ("folder", "expected"),
    [("/data/runs", "nfs4"), ("/data/a b/runs", "ext4"), ("/database", "overlay")],
)
def test_the_file_system_is_that_of_the_nearest_mount(folder: str, expected: str) -> None:
    mounts = (
        "overlay / overlay rw 0 0\n"
        "disk:/x /data nfs rw 0 0\n"
        "disk:/y /data nfs4 rw 0 0\n"
        "/dev/sdb1 /data/a\\040b ext4 rw 0 0\n"
    )
    assert host_checks.file_system(Path(folder), mounts) == expected


def test_a_network_file_system_is_an_error(
    invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(host_checks, "file_system", lambda *_: "nfs4")
    status, checks = doctor(invoke, "--journal", tmp_path / "j.db")
    assert (status, checks["journal"]["status"]) == (1, "error")
    assert "nfs4" in checks["journal"]["message"]


@pytest.mark.parametrize("bound", ["1e15", "much"])
def test_too_little_space_or_a_wrong_bound_is_an_error(
    invoke: Invoke, monkeypatch: pytest.MonkeyPatch, bound: str
) -> None:
    monkeypatch.setenv(MIN_FREE_VARIABLE, bound)
    status, checks = doctor(invoke)
    assert (status, checks["disk"]["status"]) == (1, "error")
    assert MIN_FREE_VARIABLE in checks["disk"]["message"]


def test_a_runtime_folder_that_others_can_enter_is_an_error(
    invoke: Invoke, own_runtime_folder: Path
) -> None:
    own_runtime_folder.chmod(0o755)
    status, checks = doctor(invoke)
    assert (status, checks["runtime folder"]["remedy"]) == (1, f"chmod 700 {own_runtime_folder}")


def test_a_runtime_folder_that_cannot_be_made_is_an_error(
    invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, "/proc/m2pem")
    status, checks = doctor(invoke)
    assert (status, checks["runtime folder"]["status"]) == (1, "error")


@pytest.mark.parametrize(("state", "status"), [(True, "ok"), (False, "warning"), (None, "warning")])
def test_a_clock_that_is_not_synchronised_is_a_warning(
    invoke: Invoke, monkeypatch: pytest.MonkeyPatch, state: bool | None, status: str
) -> None:
    monkeypatch.setattr(host_checks, "clock_is_synchronised", lambda: state)
    ended, checks = doctor(invoke)
    assert (ended, checks["clock"]["status"]) == (0, status)


def test_the_structure_of_the_clock_is_that_of_the_system_call() -> None:
    timex = host_checks.Timex
    assert timex.status.offset == 5 * ctypes.sizeof(ctypes.c_long)
    assert ctypes.sizeof(timex) >= 26 * ctypes.sizeof(ctypes.c_long)
    assert host_checks.clock_is_synchronised() in (True, False, None)


def test_few_open_files_are_a_warning(invoke: Invoke) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (256, hard))
    try:
        status, checks = doctor(invoke)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert (status, checks["open files"]["status"]) == (0, "warning")


# --- fleets -------------------------------------------------------------------------------------


def test_a_fleet_that_can_be_served_is_right(invoke: Invoke) -> None:
    status, checks = doctor(invoke, "--fleet", FLEET)
    assert status == 0
    assert checks["fleet"]["status"] == checks["vehicles"]["status"] == "ok"


def test_a_fleet_that_is_wrong_is_an_error_with_its_line(invoke: Invoke, tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("version: 1\nvehicles:\n  a: {domain: sky, arbiter: sim}\n")
    status, checks = doctor(invoke, "--fleet", fleet)
    assert status == 1
    assert f"{fleet}:3: " in checks["fleet"]["message"]


def test_an_arbiter_without_a_plugin_is_an_error(invoke: Invoke, tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("version: 1\nvehicles:\n  a: {domain: ground, arbiter: horse}\n")
    status, checks = doctor(invoke, "--fleet", fleet)
    assert (status, checks["arbiter horse"]["status"]) == (1, "error")
    assert "there is no arbiter 'horse'" in checks["arbiter horse"]["message"]


def test_vehicles_of_another_executive_are_a_warning(invoke: Invoke, tmp_path: Path) -> None:
    file, _ = fleet_with_state(tmp_path)
    arbiters = arbiters_of(load_fleet(str(file)), PluginManager())
    locks = VehicleLocks(addresses_of(arbiters))
    locks.acquire()
    try:
        status, checks = doctor(invoke, "--fleet", file)
    finally:
        locks.release()
    assert (status, checks["vehicles"]["status"]) == (0, "warning")
    assert f"process {os.getpid()} commands it" in checks["vehicles"]["message"]
    assert doctor(invoke, "--fleet", file)[1]["vehicles"]["status"] == "ok"


async def test_who_serves_the_fleet_on_the_journal_is_said(invoke: Invoke, tmp_path: Path) -> None:
    fleet = load_fleet(str(FLEET))
    async with opened(lambda: open_journal(str(tmp_path / "journal.db"))) as journal:
        await journal.serve_fleet(fleet.name, list(fleet.vehicles))
        words = ("--fleet", FLEET, "--journal", tmp_path / "journal.db")
        status, checks = await asyncio.to_thread(doctor, invoke, *words)
    assert (status, checks["vehicles"]["status"]) == (0, "warning")
    assert f"process {os.getpid()} on" in checks["vehicles"]["message"]
    assert checks["standby"]["message"] == "no executive stands by"


async def test_who_stands_by_is_said(invoke: Invoke, tmp_path: Path) -> None:
    fleet = load_fleet(str(FLEET))
    async with opened(lambda: open_journal(str(tmp_path / "journal.db"))) as journal:
        await StandbyNote(journal, fleet, "https://gcs2:8700/").renew()
        assert [each.page for each in await standbys_of(journal, fleet.name)] == [
            "https://gcs2:8700/"
        ]
        words = ("--fleet", FLEET, "--journal", tmp_path / "journal.db")
        _, checks = await asyncio.to_thread(doctor, invoke, *words)
    assert f"process {os.getpid()} on" in checks["standby"]["message"]


def test_a_fleet_that_is_made_up_is_refused(invoke: Invoke) -> None:
    assert invoke("doctor", "--fleet", "sim")[0] == 2


# --- plugins ------------------------------------------------------------------------------------

ASKS = """
from m2pem.api import HealthCheck, HealthStatus

@hookimpl
def m2pem_check_host(fleet):
    return [HealthCheck("tide", HealthStatus.ERROR, f"low for {fleet and fleet.name}", "wait")]
"""
RAISES = """
@hookimpl
def m2pem_check_host():
    raise OSError("no tide table")
"""
RETURNS_TEXT = """
@hookimpl
def m2pem_check_host():
    return ["high tide"]
"""


def installed(m2pem: CommandLine, folder: Path, code: str, *words: object) -> tuple[int, Checks]:
    environment = install_plugin(folder, "boat", code)
    status, out, _ = m2pem.run(
        *("doctor", "--format", "json", *map(str, words)), **environment, M2PEM_BLOCK_PLUGINS=""
    )
    return status, {check["name"]: check for check in json.loads(out)["checks"]}


def test_a_plugin_checks_the_host_for_a_fleet(m2pem: CommandLine, tmp_path: Path) -> None:
    status, checks = installed(m2pem, tmp_path, ASKS, "--fleet", FLEET)
    assert (status, checks["tide"]["message"]) == (1, "low for mehds-vignette-1")


@pytest.mark.parametrize(
    ("code", "why"),
    [(RAISES, "OSError: no tide table"), (RETURNS_TEXT, "'high tide' among its checks")],
)
def test_a_check_of_a_plugin_that_breaks_is_a_warning(
    m2pem: CommandLine, tmp_path: Path, code: str, why: str
) -> None:
    _, checks = installed(m2pem, tmp_path, code)
    assert checks["plugin boat"]["status"] == "warning"
    assert why in checks["plugin boat"]["message"]


def test_a_plugin_that_cannot_be_loaded_is_a_warning(m2pem: CommandLine, tmp_path: Path) -> None:
    _, checks = installed(m2pem, tmp_path, "import no_such_module")
    assert checks["plugin boat"]["status"] == "warning"
    assert "no_such_module" in checks["plugin boat"]["message"]


# --- a running executive ------------------------------------------------------------------------


def test_an_executive_that_runs_says_how_it_is(m2pem: CommandLine, tmp_path: Path) -> None:
    journal = tmp_path / "journal.db"
    serving = m2pem.start(
        *("serve", "--fleet", FLEET, "--simulate", "--ocu", "none", "--journal", journal)
    )
    assert "serving" in serving.stderr.readline()
    words = ("doctor", "--running", "--format", "json", "--journal", journal)
    status, out, _ = m2pem.run(*words)
    said = {check["name"]: check["status"] for check in json.loads(out)["checks"]}
    name = f"executive {serving.process.pid}"
    assert status == 0
    assert said == {
        f"{name}: {each}": "ok" for each in ("journal", "arbiters", "event loop", "standby")
    }
    status, out, _ = m2pem.run(*words, M2PEM_MIN_FREE_MB="1e15")  # it counts where it serves
    assert status == 0
    serving.process.send_signal(signal.SIGSTOP)
    try:
        status, out, _ = m2pem.run(*words)
    finally:
        serving.process.send_signal(signal.SIGCONT)
    assert status == 1
    assert [each["name"] for each in json.loads(out)["checks"]] == [name]
    serving.process.terminate()
    assert serving.rest()[0] == 0
    status, out, _ = m2pem.run(*words)
    assert status == 1
    assert json.loads(out)["checks"][0]["remedy"] == "m2pem serve starts one"


def test_a_running_executive_has_its_own_fleet(invoke: Invoke) -> None:
    assert invoke("doctor", "--running", "--fleet", FLEET)[0] == 2


# --- ports --------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [socket.SOCK_DGRAM, socket.SOCK_STREAM])
def test_a_port_in_use_is_an_error_that_says_how_to_find_the_program(
    kind: socket.SocketKind,
) -> None:
    with socket.socket(socket.AF_INET, kind) as other:
        other.bind(("127.0.0.1", 0))
        if kind is socket.SOCK_STREAM:
            other.listen()
        port = other.getsockname()[1]
        check = listening_check("port", "127.0.0.1", port, kind)
        assert check.status is HealthStatus.ERROR
        assert f"'sport = :{port}'" in check.remedy
    assert listening_check("port", "127.0.0.1", port, kind).status is HealthStatus.OK


@pytest.mark.parametrize(
    ("host", "remedy"), [("192.0.2.1", "ip address"), ("no host", "a name that this host")]
)
def test_an_address_that_is_not_of_this_host_is_an_error(host: str, remedy: str) -> None:
    check = listening_check("port", host, 0, socket.SOCK_DGRAM)
    assert check.status is HealthStatus.ERROR
    assert remedy in check.remedy
