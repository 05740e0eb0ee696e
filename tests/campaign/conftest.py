"""Missions of known probability, and campaigns of them."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from m2pem.campaign.runs import Order, order_of
from m2pem.executive.loading import load_source
from m2pem.fleet.default_fleet import fleet_for

HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
    ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">'
)


def task(element: str) -> str:
    return (
        f'<scriptTask id="{element}"><extensionElements><m2pem:behavior type="vehicle" '
        'name="hold"><properties><property name="duration" value="10 s"/></properties>'
        '<resources><role name="doer" vehicle="uav1"/></resources></m2pem:behavior>'
        "</extensionElements></scriptTask>"
    )


def sequence(*elements: str) -> bytes:
    """Tasks one after the other, each of which holds a vehicle for 10 s."""
    path = ["S", *elements, "E"]
    flows = "".join(
        f'<sequenceFlow id="{a}_{b}" sourceRef="{a}" targetRef="{b}"/>' for a, b in pairwise(path)
    )
    body = '<startEvent id="S"/><endEvent id="E"/>' + "".join(map(task, elements)) + flows
    return f'{HEAD}<process id="P">{body}</process></definitions>'.encode()


TWO = """
behaviors:
  A: {fails: {probability: 0.2, after: 1..5 s, error: BLOCKED}}
  B: {fails: {probability: 0.1}, duration: 5..15 s}
vehicles: {uav1: {battery: 50 %..100 %}}
"""
"""Fails with probability 1 - 0.8 * 0.9 = 0.28."""

MakeOrder = Callable[..., Order]


@pytest.fixture
def order() -> MakeOrder:
    """Makes the order of a campaign of two tasks."""

    def make(
        seed: int = 7,
        variations: str = TWO,
        mission: bytes | None = None,
        required: Sequence[str] = (),
    ) -> Order:
        loaded = load_source(mission or sequence("A", "B"))
        fleet = fleet_for(loaded)
        return order_of(loaded, fleet, variations.encode(), seed, required=required)

    return make


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "campaign"
