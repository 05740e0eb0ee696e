"""The contract of arbiters, kept over DDS in each of the ways in which vehicles are reached."""

from collections.abc import Collection
from typing import ClassVar

from ros_contract import OverDds

_REAL = OverDds.unsupported
_OTHER_DRIVERS: Collection[str] = (
    "test_cancel_ends_a_behavior_within_the_declared_bound",
    "test_another_arbiter_finds_the_behavior_again",
    "test_hold_stops_the_vehicle_within_the_declared_bound",
)
"""What drivers do differently. `TestNodeByTopics` holds the rest in the quick tests."""


class TestNodeByTopics(OverDds):
    driver = "m2pem"
    settings: ClassVar = {"via": "topics"}


class TestNodeByAction(OverDds):
    driver = "m2pem"
    settings: ClassVar = {"via": "action"}
    quick = _OTHER_DRIVERS


class TestNav2(OverDds):
    driver = "nav2"
    cut = "kill"
    quick = _OTHER_DRIVERS


class TestBase(OverDds):
    driver = "base"
    quick = _OTHER_DRIVERS
    unsupported: ClassVar = {
        **_REAL,
        "reconnect": "nothing on a plain base knows of behaviors: it stands when nobody drives it",
    }
