"""`m2pem doctor` for MAVLink vehicles: endpoints, serial lines, and which autopilots send."""

import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from m2pem_plugin_mavlink import host_checks
from m2pem_plugin_mavlink.host_checks import check_fleet, check_serial_line
from m2pem_plugin_mavlink.protocol.url import SerialUrl
from mavlink_signed_end import write_key
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Fleet, HealthCheck, HealthStatus
from m2pem.fleet.fleet_file import load_fleet


def fleet_of(folder: Path, **vehicles: str) -> Fleet:
    """A fleet of MAVLink copters; each with its connection."""
    lines = ["version: 1", "vehicles:"]
    for name, connection in vehicles.items():
        lines.append(f"  {name}: {{domain: air, arbiter: mavlink, connection: {{{connection}}}}}")
    file = folder / "fleet.yaml"
    file.write_text("\n".join(lines))
    return load_fleet(str(file))


def checks_of(fleet: Fleet) -> dict[str, HealthCheck]:
    return {check.name: check for check in check_fleet(fleet)}


def heartbeat(system: int) -> bytes:
    mav = dialect.MAVLink(None, srcSystem=system, srcComponent=1)
    message = mav.heartbeat_encode(2, 3, 0, 0, 4)
    return bytes(message.pack(mav))


def free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


@contextmanager
def sending(system: int, port: int) -> Iterator[None]:
    """An autopilot that sends heartbeats to a UDP port."""
    ended = threading.Event()

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
            while not ended.wait(0.02):
                autopilot.sendto(heartbeat(system), ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


@pytest.mark.parametrize(
    ("mode", "status", "message"),
    [(0o600, HealthStatus.OK, "has a key"), (0o644, HealthStatus.ERROR, "chmod 600")],
)
def test_the_key_of_a_vehicle_that_signs_is_checked(
    tmp_path: Path, mode: int, status: HealthStatus, message: str
) -> None:
    key = write_key(tmp_path)
    key.chmod(mode)
    url = f"udpout://127.0.0.1:{free_port(socket.SOCK_DGRAM)}"
    uav = f"url: '{url}', system_id: 7, signing: {{key: {key}}}"
    check = checks_of(fleet_of(tmp_path, uav=uav))["signing uav"]
    assert (check.status, message in check.message) == (status, True)


def test_an_autopilot_that_sends_is_received(tmp_path: Path) -> None:
    port = free_port(socket.SOCK_DGRAM)
    url = f"udpin://127.0.0.1:{port}"
    with sending(7, port):
        checks = checks_of(fleet_of(tmp_path, uav=f"url: '{url}', system_id: 7"))
    assert {name: check.status for name, check in checks.items()} == {
        url: HealthStatus.OK,
        "autopilot uav": HealthStatus.OK,
    }


def test_another_system_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_checks, "LISTENED_S", 1.0)
    port = free_port(socket.SOCK_DGRAM)
    with sending(9, port):
        fleet = fleet_of(tmp_path, uav=f"url: 'udpin://127.0.0.1:{port}', system_id: 7")
        check = checks_of(fleet)["autopilot uav"]
    assert check.status is HealthStatus.WARNING
    assert "systems 9 send there" in check.message
    assert "7" in check.remedy


def test_an_autopilot_is_received_over_tcp(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"tcpout://127.0.0.1:{listener.getsockname()[1]}"

        def serve() -> None:
            autopilot, _ = listener.accept()
            with autopilot:
                autopilot.sendall(heartbeat(3))
                autopilot.recv(1)  # until the other end closes: nothing is sent

        thread = threading.Thread(target=serve)
        thread.start()
        checks = checks_of(fleet_of(tmp_path, uav=f"url: '{url}', system_id: 3"))
        thread.join()
    assert checks["autopilot uav"].status is HealthStatus.OK


def test_no_connection_is_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_checks, "LISTENED_S", 0.2)
    url = f"tcpout://127.0.0.1:{free_port(socket.SOCK_STREAM)}"
    checks = checks_of(fleet_of(tmp_path, uav=f"url: '{url}', system_id: 3"))
    assert checks[url].status is HealthStatus.OK
    assert checks["autopilot uav"].status is HealthStatus.WARNING


def test_a_port_in_use_is_an_error_and_no_autopilot_is_waited_for(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        url = f"udpin://127.0.0.1:{other.getsockname()[1]}"
        checks = checks_of(fleet_of(tmp_path, uav=f"url: '{url}', system_id: 3"))
    assert [*checks] == [url]
    assert checks[url].status is HealthStatus.ERROR


def test_a_driver_that_is_not_installed_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(host_checks, "find_spec", lambda _: None)
    connection = "url: 'udpout://127.0.0.1:9', system_id: 3, driver: mavsdk"
    check = checks_of(fleet_of(tmp_path, uav=connection))["mavsdk"]
    assert check.status is HealthStatus.ERROR
    assert check.remedy == "pip install 'm2pem-plugin-mavlink[mavsdk]'"


def test_settings_that_are_wrong_are_left_to_the_check_of_the_fleet(tmp_path: Path) -> None:
    assert checks_of(fleet_of(tmp_path, uav="url: 'udpin://127.0.0.1:1'")) == {}


def test_serial_lines_are_opened(tmp_path: Path) -> None:
    far, near = os.openpty()
    try:
        line = SerialUrl(os.ttyname(near))
        assert check_serial_line(line).status is HealthStatus.OK
    finally:
        os.close(far)
        os.close(near)
    missing = check_serial_line(SerialUrl(str(tmp_path / "ttyACM0")))
    assert missing.status is HealthStatus.ERROR
    assert "/dev/serial/by-id" in missing.remedy
    (tmp_path / "file").touch()
    file = check_serial_line(SerialUrl(str(tmp_path / "file")))
    assert file.status is HealthStatus.ERROR
    assert "is not a serial line" in file.message


def test_a_serial_line_without_permission_names_the_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError(13, "Permission denied")

    line = tmp_path / "ttyUSB0"
    line.touch()
    monkeypatch.setattr(host_checks.os, "open", refuse)
    check = check_serial_line(SerialUrl(str(line)))
    assert check.status is HealthStatus.ERROR
    assert f"usermod -a -G {line.group()} $USER" in check.remedy
