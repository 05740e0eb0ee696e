"""Reading a connection of the fleet file."""

from collections.abc import Callable
from enum import StrEnum
from typing import Any

import pytest

from m2pem.api import ConnectionReader, Dimension, ResourceId
from m2pem.errors import PluginError

KNOWN = ("port", "speed", "via")


class Via(StrEnum):
    TOPICS = "topics"
    ACTION = "action"


def reader(**values: Any) -> ConnectionReader:
    return ConnectionReader(ResourceId("ugv1"), values)


def test_values_are_read_in_si_and_missing_ones_are_the_defaults() -> None:
    given = reader(port=80, speed="36 km/h", via="action", bounds={"speed": 1})
    assert given.whole("port", None, 1, 99) == 80
    assert given.quantity("speed", 2.0, Dimension.SPEED) == pytest.approx(10.0)
    assert given.choice("via", Via, Via.TOPICS) is Via.ACTION
    assert given.inner("bounds", "{speed: 1 m/s}").values == {"speed": 1}
    nothing = reader()
    assert nothing.whole("port", 7, 1, 99) == 7
    assert nothing.quantity("speed", 2.0, Dimension.SPEED) == 2.0
    assert nothing.choice("via", Via, Via.TOPICS) is Via.TOPICS
    assert (nothing.flag("on", True), nothing.text("name", "x")) == (True, "x")
    assert nothing.inner("bounds", "{speed: 1 m/s}").values == {}


@pytest.mark.parametrize(
    ("values", "read", "says"),
    [
        ({}, lambda r: r.whole("port", None, 1, 9, "the port"), "it is missing: the port, 1 to 9"),
        ({"port": True}, lambda r: r.whole("port", 1, 1, 9), "True is not a whole number from 1"),
        ({"port": 1e9}, lambda r: r.number("port", 1, 1, 9), "1000000000.0 is not a number from 1"),
        ({"port": " "}, lambda r: r.text("port", ""), "' ' is not a text"),
        ({"port": 1}, lambda r: r.flag("port", True), "1 is neither true nor false"),
        ({"port": "x"}, lambda r: r.choice("port", Via, Via.TOPICS), "'x' is none of topics, act"),
        ({"port": 1}, lambda r: r.inner("port", "{a: 1}"), "1 is not a map such as {a: 1}"),
        (
            {"port": "3 m/s"},
            lambda r: r.quantity("port", 0.0, Dimension.SPEED, 0.0, 2.0),
            "'3 m/s' is not within 0 and 2 (SI)",
        ),
    ],
)
def test_an_error_names_the_resource_and_the_key(
    values: dict[str, Any], read: Callable[[ConnectionReader], object], says: str
) -> None:
    with pytest.raises(PluginError) as raised:
        read(reader(**values))
    assert str(raised.value).startswith(f"ugv1: connection.port: {says}")


def test_an_inner_map_is_named_in_its_errors() -> None:
    inner = reader(bounds={"sped": 1}).inner("bounds", "{speed: 1 m/s}")
    with pytest.raises(PluginError, match=r"connection\.bounds\.sped: .*did you mean 'speed'"):
        inner.refuse_others(KNOWN)


def test_unknown_keys_are_refused_or_only_misspelled_ones() -> None:
    with pytest.raises(PluginError, match="known: port, speed, via"):
        reader(quite_another=1).refuse_others(KNOWN)
    reader(quite_another=1).refuse_misspelled(KNOWN)
    with pytest.raises(PluginError, match="did you mean 'speed'"):
        reader(sped=1).refuse_misspelled(KNOWN)
    reader(sped=1, speed=1).refuse_misspelled(KNOWN)
