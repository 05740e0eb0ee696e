"""The contract of arbiters, kept over DDS in each of the ways in which vehicles are reached."""

from typing import ClassVar

from ros_contract import OverDds

_REAL = OverDds.unsupported


class TestNodeByTopics(OverDds):
    driver = "m2pem"
    settings: ClassVar = {"via": "topics"}


class TestNodeByAction(OverDds):
    driver = "m2pem"
    settings: ClassVar = {"via": "action"}


class TestNav2(OverDds):
    driver = "nav2"
    cut = "kill"


class TestBase(OverDds):
    driver = "base"
    unsupported: ClassVar = {
        **_REAL,
        "reconnect": "nothing on a plain base knows of behaviors: it stands when nobody drives it",
    }
