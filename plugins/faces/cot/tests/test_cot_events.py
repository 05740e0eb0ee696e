"""What is sent, and what of received bytes is used."""

import contextlib
import sys
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree
from m2pem_plugin_cot.events import geometry_event, vehicle_event
from m2pem_plugin_cot.received import MAX_EVENT_BYTES, EventError, EventStream, read_event
from takproto import TAKProtoVer, xml2proto
from takproto.proto import TakMessage

from m2pem.api import Area, GeoPosition, Point, Route, VehicleState

AT_US = 1_767_225_600_123_456
STATE = VehicleState(
    "rover1",
    AT_US,
    GeoPosition(38.1075001, -77.3192002, 60.0),
    velocity_enu_m_s=(3.0, 4.0, 0.0),
    yaw_rad=0.0,
    battery_fraction=0.5,
)
PLACE = (38.1075, -77.3192, None)
RING = (PLACE, (38.1075, -77.31, None), (38.11, -77.31, None), PLACE)


def event(**changes: str) -> bytes:
    values = {"type": "b-m-p-s-m", "point": 'lat="38.1" lon="-77.3"', "detail": ""}
    values |= changes
    return (
        f'<event version="2.0" uid="m1" type="{values["type"]}"><point {values["point"]}/>'
        f'<detail><contact callsign="lz"/>{values["detail"]}</detail></event>'
    ).encode()


def test_a_vehicle_is_where_its_telemetry_says() -> None:
    sent = etree.fromstring(vehicle_event("u1", "a-f-G", STATE, 30.0, "AUTO\x07"))
    point = sent.find("point")
    assert (point.get("lat"), point.get("lon")) == ("38.1075001", "-77.3192002")
    # 60 m above mean sea level, where that is 34.0 m below the ellipsoid.
    assert (point.get("hae"), point.get("le")) == ("26.0", "9999999.0")
    assert sent.get("time") == "2026-01-01T00:00:00.123Z"
    assert sent.get("stale") == "2026-01-01T00:00:30.123Z"
    assert dict(sent.find("detail/track").attrib) == {"speed": "5.00", "course": "90.0"}
    assert sent.find("detail/status").get("battery") == "50"
    assert sent.findtext("detail/remarks") == "AUTO "


def test_a_vehicle_without_a_position_is_not_sent() -> None:
    assert vehicle_event("u1", "a-f-G", VehicleState("rover1", AT_US), 30.0, "") is None


@pytest.mark.parametrize(
    "geometry", [Point(PLACE), Route((PLACE, (38.11, -77.3, None))), Area((RING,))]
)
def test_a_geometry_that_is_sent_is_read_back(geometry: Point | Route | Area) -> None:
    received = read_event(geometry_event("u1", "lz", geometry, AT_US, 60.0))
    assert received is not None
    assert (received.name, received.geometry) == ("lz", geometry)


@pytest.mark.parametrize(
    ("frame", "hae", "corner"),
    [
        ("amsl", "26.0", "38.1100000,-77.3000000,66.0"),
        ("relative", "9999999.0", "38.1100000,-77.3000000"),
        ("terrain", "9999999.0", "38.1100000,-77.3000000"),
    ],
)
def test_a_waypoint_has_a_height_above_the_ellipsoid_if_its_altitude_is_above_sea_level(
    frame: str, hae: str, corner: str
) -> None:
    route = Route(((38.1075, -77.3192, 60.0), (38.11, -77.3, 100.0)), frame)
    sent = etree.fromstring(geometry_event("u1", "lane", route, AT_US, 60.0))
    assert sent.find("point").get("hae") == hae
    assert sent.findall("detail/link")[1].get("point") == corner


def test_where_somebody_is_draws_nothing() -> None:
    assert read_event(vehicle_event("u1", "a-f-G", STATE, 30.0, "") or b"") is None


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "no XML"),
        (b"\xff\xfe<event/>", "no XML"),
        (b"<event", "no XML"),
        (b"<other/>", "its root is no event"),
        (event(point='lat="nan" lon="0"'), "no place"),
        (event(point='lat="91" lon="0"'), "no place"),
        (event(point='lon="0"'), "no place"),
        (event(type="b-m-r"), "0 corners"),
        (event(type="u-d-f", detail='<link point="1,1"/>' * 3), "three corners"),
        (event(type="u-d-f", detail='<link point="1,1"/>' * 1001), "1001 corners"),
        (event(detail="x" * MAX_EVENT_BYTES), "more than"),
        (b'<!DOCTYPE e [<!ENTITY a "aaaa">]>' + event(detail="&a;"), "document type"),
        (event(detail="&a;"), "no XML"),
    ],
)
def test_what_cannot_be_used_is_refused(content: bytes, says: str) -> None:
    with pytest.raises(EventError, match=says):
        read_event(content)


@given(st.binary(max_size=2000))
def test_no_bytes_do_more_than_be_refused(content: bytes) -> None:
    with contextlib.suppress(EventError):
        assert read_event(content) is None


@given(
    st.lists(st.sampled_from([event(), b"<event/>noise", b"x" * 70_000]), max_size=6),
    st.integers(1, 5000),
)
def test_a_stream_is_split_into_its_events_wherever_it_is_cut(
    parts: list[bytes], size: int
) -> None:
    whole = b"\n".join(parts) + b"\n"
    stream, found = EventStream(), []
    for start in range(0, len(whole), size):
        found += stream.feed(whole[start : start + size])
    at_once = list(EventStream().feed(whole))
    assert all(each.endswith(b"</event>") for each in found)
    assert len(found) <= sum(part == event() for part in parts)
    if all(part == event() for part in parts):
        assert found == at_once == [event()] * len(parts)


class Counted(bytes):
    """Bytes that count how many of them are copied."""

    copied = 0

    def __add__(self, other: bytes) -> "Counted":
        return Counted(super().__add__(other))

    def __radd__(self, other: bytes) -> "Counted":
        return Counted(other + bytes(self))

    def __getitem__(self, key: Any) -> Any:
        part = super().__getitem__(key)
        if not isinstance(part, bytes):
            return part
        Counted.copied += len(part)
        return Counted(part)


def test_many_small_events_at_once_are_copied_once() -> None:
    """A server must not hold up the executive: copying the rest for each event took 0.2 s."""
    Counted.copied = 0
    content = Counted(b"</event>" * 32_768)
    assert sum(1 for _ in EventStream().feed(content)) == 32_768
    assert Counted.copied <= 2 * len(content)


def test_what_a_sender_calls_itself_is_one_line() -> None:
    content = event().replace(b'uid="m1"', b'uid="anna&#10;WARNING&#x9b;31m&#x202e;"')
    found = read_event(content)
    assert found is not None
    assert found.uid == "anna WARNING 31m "
    with pytest.raises(EventError) as raised:
        read_event(b"<" + b"a" * 40_000 + b"></b>")
    assert len(str(raised.value)) < 200


@pytest.mark.parametrize("time_us", [-(1 << 60), 1 << 60])
def test_a_vehicle_whose_clock_is_wrong_is_sent_all_the_same(time_us: int) -> None:
    sent = vehicle_event("uid", "a-f-G", replace(STATE, time_us=time_us), 30.0, "")
    assert sent is not None
    assert etree.fromstring(sent).get("stale") >= etree.fromstring(sent).get("time")


def test_a_document_type_in_another_encoding_is_none() -> None:
    entity = b'+ADwAIQ-DOCTYPE x [+ADwAIQ-ENTITY a "anna"+AD4AXQA+-'
    content = b'<?xml version="1.0" encoding="UTF-7"?>' + entity + event()
    with pytest.raises(EventError, match="no XML"):
        read_event(content.replace(b'uid="m1"', b'uid="&a;"'))


def mesh(content: bytes) -> bytes:
    """An event as takproto writes it into a datagram."""
    return bytes(xml2proto(content.decode(), TAKProtoVer.MESH))


def stream_of(content: bytes) -> bytes:
    """An event as takproto writes it into a stream."""
    return bytes(xml2proto(content.decode(), TAKProtoVer.STREAM))


def protobuf(**fields: Any) -> bytes:
    made = TakMessage()
    for name, value in {"type": "b-m-p-s-m", "uid": "m1", "lat": 38.1, "lon": -77.3}.items():
        setattr(made.cotEvent, name, value)
    for name, value in fields.items():
        if name == "callsign":
            made.cotEvent.detail.contact.callsign = value
        elif name == "xmlDetail":
            made.cotEvent.detail.xmlDetail = value
        else:
            setattr(made.cotEvent, name, value)
    return b"\xbf\x01\xbf" + bytes(made.SerializeToString())


@pytest.mark.parametrize(
    "geometry", [Point(PLACE), Route((PLACE, (38.11, -77.3, None))), Area((RING,))]
)
def test_the_tak_protocol_of_takproto_is_read_as_its_xml(geometry: Point | Route | Area) -> None:
    content = geometry_event("u1", "l<&\"'z", geometry, AT_US, 60.0)
    expected = read_event(content)
    assert expected is not None
    assert read_event(mesh(content)) == expected
    (found,) = EventStream().feed(stream_of(content))
    assert read_event(found) == expected


def test_who_is_where_in_the_tak_protocol_draws_nothing() -> None:
    assert read_event(mesh(vehicle_event("u1", "a-f-G", STATE, 30.0, "") or b"")) is None


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\xbf\x02\xbf" + mesh(event())[3:], "another version"),
        (b"\xbf\x00\xbf" + event(), "another version"),
        (b"\xbf\xff\xff\x03\xbf", "another version"),
        (mesh(event())[:-5], "no valid protobuf"),
        (b"\xbf\x01\xbf<event/>", "no valid protobuf"),
        (protobuf(uid="m1")[:3] + b"\x12\xff\xff\xff\xff\x0f", "no valid protobuf"),
        (protobuf(lat=float("nan")), "no place"),
        (protobuf(lat=91.0), "no place"),
        (protobuf(xmlDetail="<!DOCTYPE x>"), "document type"),
        (protobuf(xmlDetail="&a;"), "no XML"),
        (protobuf(xmlDetail="</detail></event><event>"), "no XML"),
        (protobuf(callsign="\x01"), "no XML"),
        (protobuf(callsign="&" * 30_000), "more than"),
        (protobuf(callsign="x" * MAX_EVENT_BYTES), "more than"),
    ],
)
def test_what_of_the_tak_protocol_cannot_be_used_is_refused(content: bytes, says: str) -> None:
    with pytest.raises(EventError, match=says):
        read_event(content)


def test_without_takproto_the_tak_protocol_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    content = mesh(event())
    for name in ("takproto", "takproto.proto"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(EventError, match=r"TAK protocol.*m2pem-plugin-cot\[tak\]"):
        read_event(content)


@given(st.binary(max_size=500))
def test_no_bytes_of_the_tak_protocol_do_more_than_be_refused(content: bytes) -> None:
    with contextlib.suppress(EventError):
        assert read_event(b"\xbf\x01\xbf" + content) is None


@given(
    st.lists(
        st.sampled_from([event(), stream_of(event()), b"\xbf\x80\x80\x04" + b"x" * 65_536]),
        max_size=6,
    ),
    st.integers(1, 5000),
)
def test_a_stream_may_have_xml_and_the_tak_protocol_wherever_it_is_cut(
    parts: list[bytes], size: int
) -> None:
    whole = b"\n".join(parts) + b"\n"
    stream, found = EventStream(), []
    for start in range(0, len(whole), size):
        found += stream.feed(whole[start : start + size])
    read = [event(), stream_of(event())]
    assert [each.endswith(b"</event>") for each in found] == [
        part == event() for part in parts if part in read
    ]
    assert {read_event(each) for each in found} <= {read_event(event())}
    assert stream.too_long == sum(part not in read for part in parts)
