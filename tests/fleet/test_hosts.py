"""Hosts in fleet files: what is read, and what `m2pem check` finds wrong with them."""

from pathlib import Path

import pytest

from m2pem.errors import FleetError
from m2pem.fleet.fleet import Fleet, dump, real_resources, restore, simulated_fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.fleet.hosts import CutOffPolicy, WhenCutOff
from m2pem.mission.catalogue import ResourceId

UGV1 = ResourceId("ugv1")
TLS = "tls: {ca: ca.pem, certificate: link.pem, key: link.key}"


def fleet(folder: Path, host: str, vehicle: str = "host: pi") -> Fleet:
    file = folder / "fleet.yaml"
    file.write_text(
        "version: 1\n"
        "hosts:\n"
        f"  pi: {{{host}}}\n"
        "vehicles:\n"
        f"  ugv1: {{domain: ground, arbiter: sim, {vehicle}}}\n"
    )
    return load_fleet(file)


def test_a_host_is_read_with_its_files_beside_the_fleet(tmp_path: Path) -> None:
    read = fleet(tmp_path, f"connect: ['tls/10.0.0.7:7447'], {TLS}, round_trip: 500 ms")
    host = read.hosts["pi"]
    assert (host.connect, host.round_trip_s) == (("tls/10.0.0.7:7447",), 0.5)
    assert (host.ca, host.key) == (str(tmp_path / "ca.pem"), str(tmp_path / "link.key"))
    assert read.vehicles[UGV1].host == "pi"


@pytest.mark.parametrize(
    ("said", "policy"),
    [
        ("host: pi", CutOffPolicy(WhenCutOff.HOLD, 10.0)),
        ("host: pi, when_cut_off: continue", CutOffPolicy(WhenCutOff.CONTINUE, 10.0)),
        (
            "host: pi, when_cut_off: {action: end, after: 1 min, behaviors: {orbit: continue}}",
            CutOffPolicy(WhenCutOff.END, 60.0, {"orbit": WhenCutOff.CONTINUE}),
        ),
    ],
)
def test_a_vehicle_says_what_its_host_does_alone(
    tmp_path: Path, said: str, policy: CutOffPolicy
) -> None:
    assert (
        fleet(tmp_path, "connect: ['tcp/127.0.0.1:7447']", said).vehicles[UGV1].when_cut_off
        == policy
    )


def test_a_fleet_with_hosts_is_the_same_from_the_journal(tmp_path: Path) -> None:
    vehicle = "host: pi, when_cut_off: {action: end, behaviors: {orbit: continue}}"
    read = fleet(tmp_path, f"listen: ['tls/0.0.0.0:7447'], {TLS}", vehicle)
    assert restore(dump(read)) == read


def test_what_a_host_simulates_has_that_hosts_clock(tmp_path: Path) -> None:
    read = fleet(tmp_path, "connect: ['tcp/127.0.0.1:7447']")
    assert real_resources(read) == [UGV1]
    assert not read.simulated
    assert simulated_fleet(read).vehicles[UGV1].host == ""
    assert simulated_fleet(read).simulated


@pytest.mark.parametrize(
    ("host", "vehicle", "line", "message", "remedy"),
    [
        ("connect: ['tcp/127.0.0.1:1']", "host: pii", 5, "no host is named 'pii'", "'pi'"),
        ("connect: ['tcp/127.0.0.1:1']", "when_cut_off: hold", 5, "cannot be cut off", "'host'"),
        ("round_trip: 1 s", "host: pi", 3, "where the executive connects to", "connect:"),
        ("connect: ['10.0.0.7']", "host: pi", 3, "'10.0.0.7' is no endpoint", "tls/ADDRESS"),
        ("connect: ['tcp/127.0.0.1:0']", "host: pi", 3, "is no endpoint", "tls/ADDRESS"),
        ("connect: ['tcp/10.0.0.7:1']", "host: pi", 3, "anyone there could command", "tls/"),
        ("listen: ['tcp/0.0.0.0:1']", "host: pi", 3, "anyone there could command", "tls/"),
        (f"connect: ['tcp/10.0.0.7:1'], {TLS}", "host: pi", 3, "anyone there", "tls/"),
        ("connect: ['tls/h:1'], tls: {ca: a}", "host: pi", 3, "anyone there", "certificate"),
        ("connect: ['tls/127.0.0.1:1']", "host: pi", 3, "files of TLS", "add 'tls"),
        (f"connect: ['tls/h:1'], {TLS[:-18]}}}", "host: pi", 3, "belong together", "both"),
        ("conect: ['tls/h:1']", "host: pi", 3, "unknown key 'conect'", "connect"),
        ("connect: ['tcp/[::1]:1']", "host: pi, when_cut_off: stop", 5, "'stop'", ""),
    ],
)
def test_a_mistake_is_found_with_its_line_and_remedy(
    tmp_path: Path, host: str, vehicle: str, line: int, message: str, remedy: str
) -> None:
    with pytest.raises(FleetError) as refused:
        fleet(tmp_path, host, vehicle)
    found = refused.value.findings
    assert any(
        message in each.message and remedy in each.remedy and each.line == line for each in found
    ), found
