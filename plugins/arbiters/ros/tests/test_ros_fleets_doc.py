"""Holds the fleets of docs/ros*.md to what the code does."""

import re
from dataclasses import fields
from pathlib import Path

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.catalogue import LEVEL, PAYLOAD
from m2pem_plugin_ros.settings import (
    BOUNDS,
    DETECTOR_KEYS,
    DetectorMessage,
    DriverName,
    OdomFrame,
    RouteAction,
    Settings,
    Topics,
    Via,
    read_detectors,
    read_payloads,
    read_settings,
)

import m2pem
from m2pem.api import Connection, Fleet, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import context

DOCS = Path(__file__).parents[4] / "docs"
TEXT = "".join(page.read_text(encoding="utf-8") for page in sorted(DOCS.glob("ros*.md")))
FLEETS = [block for block in re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL) if "ros" in block]
WHOLE = [block for block in FLEETS if block.startswith("version:")]


def connections(fleet: Fleet) -> dict[ResourceId, Connection]:
    vehicles = {
        v.id: Connection(v.id, v.domain.value, v.settings)
        for v in fleet.vehicles.values()
        if v.arbiter == "ros"
    }
    payloads = {
        p.id: Connection(
            p.id,
            fleet.vehicles[p.vehicle].domain.value,
            p.settings,
            p.behaviors,
            p.detector,
        )
        for p in fleet.payloads.values()
        if p.arbiter == "ros"
    }
    return {**vehicles, **payloads}


@pytest.mark.parametrize("block", WHOLE)
def test_the_fleets_can_be_used(block: str, tmp_path: Path) -> None:
    path = tmp_path / "fleet.yaml"
    path.write_text(block, encoding="utf-8")
    made = connections(m2pem.load_fleet(path))
    vehicles = read_settings(made)
    payloads = read_payloads(made, vehicles)
    assert {*vehicles, *payloads, *read_detectors(made, payloads)} == set(made) != set()
    allowed = {each: made[each].behaviors or () for each in payloads}
    arbiter = RosArbiter(made, context(SystemClock()))
    for payload, names in allowed.items():
        assert set(names) <= {spec.name for spec in arbiter.catalogue(payload)}


def test_there_are_fleets() -> None:
    assert len(WHOLE) >= 2


def test_every_setting_is_explained() -> None:
    keys = {each.name for each in fields(Settings)} | {each.name for each in fields(Topics)}
    keys |= {"sim", *DETECTOR_KEYS}
    enums = (DriverName, Via, RouteAction, OdomFrame, DetectorMessage)
    words = {str(word) for enum in enums for word in enum}
    assert {name for name in keys | words if f"`{name}`" not in TEXT} == set()


def test_every_bound_is_explained_and_no_other() -> None:
    table = TEXT.split("| `bounds` | default")[1].split("\n\n")[0]
    assert re.findall(r"^\| `(\w+)`", table, re.MULTILINE) == list(BOUNDS)


def test_every_behavior_is_named() -> None:
    offered = (*LEVEL, *PAYLOAD)
    assert {spec.name for spec in offered if f"`{spec.name}`" not in TEXT} == set()
