"""Recordings, read back by the libraries of MCAP, ROS and Foxglove."""

import asyncio
import hashlib
import math
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import jsonschema
import msgspec
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from lxml import etree
from m2pem_plugin_recorder.fleets import fleet_json
from m2pem_plugin_recorder.recording import recording_files
from m2pem_plugin_recorder.telemetry_messages import TelemetryEncoder
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoder
from mcap_ros2.decoder import DecoderFactory as Ros2Decoder
from recording_world import DRIVE, FIELD, GATE, ROAD, recorded, simulated_fleet

import m2pem
from m2pem.api import GeoPosition, LocalFrame, StampedRecord, VehicleState
from m2pem.fleet.hosts import Host
from m2pem.testing import MissionResult, run_executive, scenarios
from m2pem.testing.harness import run_mission_on
from m2pem.testing.scenarios import ORIGIN, drawn, question

FOXGLOVE = ("LocationFix", "PoseInFrame", "FrameTransform", "SceneUpdate", "GeoJSON")
VEHICLE = [
    *(f"/ugv1/{each}" for each in ("location", "pose", "fix", "odom", "battery_state")),
    "/tf",
]


def record_messages(*paths: Path) -> list[dict[str, Any]]:
    found = []
    for path in paths:
        with path.open("rb") as file:
            for _, channel, message in make_reader(file).iter_messages("/m2pem/records"):
                assert channel.message_encoding == "json"
                found.append(msgspec.json.decode(message.data))
                assert message.sequence == found[-1]["seq"]
    return found


def lines(records: "list[StampedRecord]") -> list[dict[str, Any]]:
    found = [
        {"run": each.run, "seq": each.seq, "t": each.t_s, **msgspec.to_builtins(each.record)}
        for each in records
    ]
    return msgspec.json.decode(msgspec.json.encode(found), type=list[dict[str, Any]])


def record(folder: Path, mission: bytes = DRIVE, **settings: Any) -> list[StampedRecord]:
    """Run a mission with a recorder beside it; returns the journal's records."""

    async def main() -> list[StampedRecord]:
        async with (
            run_executive(simulated_fleet(), speed=20.0) as control,
            recorded(control, folder, **settings),
        ):
            return list((await run_mission_on(control, mission)).stamped)

    return asyncio.run(main())


@pytest.mark.tried_with(
    "MCAP",
    "reads a recording",
    kind="Recordings and analysis",
    result="every record once",
    package="mcap",
)
def test_every_record_of_the_journal_is_there_once(tmp_path: Path) -> None:
    records = record(tmp_path)
    (path,) = tmp_path.glob("r1-*.mcap")
    assert record_messages(path) == lines(records)
    assert path.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("mission", [DRIVE, question()])
def test_records_and_states_are_as_their_json_schemas_say(tmp_path: Path, mission: bytes) -> None:
    record(tmp_path, mission)
    (path,) = tmp_path.glob("r1-*.mcap")
    seen = set()
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.message_encoding == "json":
                assert schema is not None
                assert schema.encoding == "jsonschema"
                told = msgspec.json.decode(schema.data)
                assert told["type"] == "object"
                jsonschema.validate(msgspec.json.decode(message.data), told)
                seen.add(channel.topic)
    other = "/m2pem/telemetry" if mission == DRIVE else "/m2pem/prompts"
    assert seen >= {"/m2pem/records", other}


def test_questions_and_answers_are_messages(tmp_path: Path) -> None:
    record(tmp_path, question("Go on?", ("continue", "abort")))
    (path,) = tmp_path.glob("r1-*.mcap")
    with path.open("rb") as file:
        prompts = [
            msgspec.json.decode(message.data)
            for _, _, message in make_reader(file).iter_messages("/m2pem/prompts")
        ]
    assert [each["state"] for each in prompts] == ["open", "answered"]
    assert prompts[0]["text"] == "Go on?"
    assert (prompts[1]["decision"], prompts[1]["by"]) == ("continue", "test")


@pytest.mark.parametrize("name", FOXGLOVE)
@pytest.mark.tried_with(
    "Foxglove's schemas",
    "are compared with those of a recording, field by field",
    kind="Recordings and analysis",
    result="the same",
    package="foxglove-schemas-protobuf",
)
def test_foxglove_schemas_are_those_of_foxglove(tmp_path: Path, name: str) -> None:
    """Field by field, against the schemas that Foxglove publishes for Python."""
    record(tmp_path)
    (path,) = tmp_path.glob("r1-*.mcap")
    published = import_module(f"foxglove_schemas_protobuf.{name}_pb2").DESCRIPTOR
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    schema = next(s for s in summary.schemas.values() if s.name == f"foxglove.{name}")
    assert schema.encoding == "protobuf"
    files = FileDescriptorSet.FromString(schema.data).file
    found = next(f for f in files if any(m.name == name for m in f.message_type))
    assert fields(next(m for m in found.message_type if m.name == name)) == fields(
        next(m for m in file_of(published).message_type if m.name == name)
    )


def file_of(descriptor: Any) -> FileDescriptorProto:
    copied = FileDescriptorProto()
    descriptor.CopyToProto(copied)
    return copied


def fields(message: Any) -> set[tuple[Any, ...]]:
    return {(f.name, f.number, f.type, f.label, f.type_name) for f in message.field}


@pytest.mark.tried_with(
    "MCAP",
    "decodes the positions of a recording",
    kind="Recordings and analysis",
    result="the same in all schemas",
    package="mcap-ros2-support",
)
def test_positions_are_the_same_in_all_schemas(tmp_path: Path) -> None:
    record(tmp_path)
    (path,) = tmp_path.glob("r1-*.mcap")
    east, north, _ = LocalFrame(ORIGIN).to_enu(GATE[0], GATE[1], ORIGIN[2])
    found: dict[str, list[Any]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[ProtobufDecoder(), Ros2Decoder()])
        for _, channel, _, message in reader.iter_decoded_messages(VEHICLE):
            found.setdefault(channel.topic, []).append(message)
    lengths = {topic: len(each) for topic, each in found.items() if topic != "/tf"}
    assert len(set(lengths.values())) == 1, lengths
    assert len(lengths) == 5
    for location, fix in zip(found["/ugv1/location"], found["/ugv1/fix"], strict=True):
        assert (location.latitude, location.longitude) == (fix.latitude, fix.longitude)
        # On the ground, 60 m above mean sea level, which is 33.97 m below the ellipsoid there.
        assert location.altitude == fix.altitude == pytest.approx(26.03, abs=0.01)
        assert location.timestamp.seconds == fix.header.stamp.sec
        assert location.frame_id == fix.header.frame_id == "ugv1/base_link"
    nearest = 1e9
    for pose, odom in zip(found["/ugv1/pose"], found["/ugv1/odom"], strict=True):
        place, same = pose.pose.position, odom.pose.pose.position
        assert (place.x, place.y, place.z) == (same.x, same.y, same.z)
        turn, other = pose.pose.orientation, odom.pose.pose.orientation
        assert (turn.x, turn.y, turn.z, turn.w) == (other.x, other.y, other.z, other.w)
        assert (pose.frame_id, odom.child_frame_id) == ("map", "ugv1/base_link")
        # A ground vehicle moves forwards.
        twist = odom.twist.twist.linear
        assert twist.x >= -1e-6
        assert abs(twist.y) < 0.3 + 0.2 * twist.x
        nearest = min(nearest, math.dist((place.x, place.y), (east, north)))
    assert nearest < 5.0
    assert {each.child_frame_id for each in found["/tf"]} == {"ugv1/base_link", "ugv2/base_link"}
    assert all(0.0 < each.percentage <= 1.0 for each in found["/ugv1/battery_state"])


def test_routes_and_areas_are_a_scene_and_geojson(tmp_path: Path) -> None:
    record(tmp_path)
    (path,) = tmp_path.glob("r1-*.mcap")
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[ProtobufDecoder()])
        decoded = [
            (channel.topic, message)
            for _, channel, _, message in reader.iter_decoded_messages(
                ["/m2pem/scene", "/m2pem/geometries"]
            )
        ]
    entities = {
        entity.id: entity
        for topic, each in decoded
        if topic == "/m2pem/scene"
        for entity in each.entities
    }
    assert {"road", "field", "gate", "home"} <= entities.keys()
    corner = entities["road"].lines[0].points[1]
    east, north, _ = LocalFrame(ORIGIN).to_enu(*ROAD.waypoints[1][:2], ORIGIN[2])
    assert (corner.x, corner.y) == pytest.approx((east, north))
    assert len(entities["field"].lines[0].points) == len(FIELD.rings[0]) - 1
    text = next(each.geojson for topic, each in decoded if topic == "/m2pem/geometries")
    names = {each["properties"]["name"] for each in msgspec.json.decode(text)["features"]}
    assert names == {"road", "field", "gate", "home"}


def test_what_the_mission_has_drawn_is_in_the_scene_until_the_run_has_ended(tmp_path: Path) -> None:
    async def main() -> None:
        async with run_executive(simulated_fleet()) as control, recorded(control, tmp_path):
            other = await control.start(question())
            run = await control.start(drawn(question(), lane=ROAD))
            for each in (run, other):
                await control.stop(each)
                await control.wait(each)

    asyncio.run(main())
    (path,) = tmp_path.glob("r1-*.mcap")
    shown: set[str] = set()
    seen: set[str] = set()
    gone: set[str] = set()
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[ProtobufDecoder()])
        for _, _, _, update in reader.iter_decoded_messages(["/m2pem/scene"]):
            gone |= {each.id for each in update.deletions}
            shown -= {each.id for each in update.deletions}
            shown |= {each.id for each in update.entities}
            seen |= shown
    assert seen == {"road", "field", "gate", "home", "r2/lane"}
    assert gone == {"r2/lane"}
    assert "r2/lane" not in shown


def test_mission_diagram_and_fleet_are_attached(tmp_path: Path) -> None:
    record(tmp_path)
    (path,) = tmp_path.glob("r1-*.mcap")
    with path.open("rb") as file:
        reader = make_reader(file)
        attached = {each.name: each for each in reader.iter_attachments()}
        (metadata,) = list(reader.iter_metadata())
    bpmn, svg = attached["mission.bpmn"], attached["mission.svg"]
    assert bpmn.data == DRIVE
    assert etree.fromstring(svg.data).tag == "{http://www.w3.org/2000/svg}svg"
    fleet = msgspec.json.decode(attached["fleet.json"].data)["fleet"]
    assert set(fleet["vehicles"]) == {"ugv1", "ugv2"}
    assert fleet["payloads"]["ugv1/camera"]["settings"] == {}
    told = metadata.metadata
    assert told["mission_sha256"] == hashlib.sha256(DRIVE).hexdigest()
    assert (told["run"], told["m2pem"], told["part"]) == ("r1", m2pem.__version__, "1")


@pytest.mark.parametrize(
    "wrong", [{"time_us": -1}, {"time_us": 1 << 60}, {"yaw_rad": math.inf}, {"mode": "\udcff"}]
)
def test_a_state_that_no_schema_can_hold_is_left_out(
    wrong: dict[str, Any], caplog: pytest.LogCaptureFixture
) -> None:
    """It ended the recordings of all runs."""
    good = VehicleState("ugv1", 1_767_225_600_123_456, GeoPosition(*GATE[:2], 60.0), yaw_rad=0.1)
    encoder = TelemetryEncoder(LocalFrame(ORIGIN))
    for _ in range(3):
        assert not encoder.messages(replace(good, **wrong))
    assert encoder.messages(good)
    assert caplog.text.count("ugv1: a state is left out: ") == 1


def test_no_address_is_handed_on_with_a_recording() -> None:
    secrets = {"ugv1": {"url": "udp://10.0.0.7:1", "password_file": "/etc/secret"}}
    made = scenarios.fleet("sim", secrets)
    host = Host("truck", connect=("tls/10.0.0.7:7447",), credentials="/etc/secret")
    told = fleet_json(replace(made, hosts={"truck": host}, faces={"cot": {"url": "10.0.0.7"}}))
    assert b"10.0.0.7" not in told
    assert b"secret" not in told


def test_a_full_file_is_followed_by_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_recorder.settings.MB", 10_000)
    monkeypatch.setattr("m2pem_plugin_recorder.recording.CHUNK_BYTES", 10_000)
    records = record(tmp_path, file_mb=1)
    paths = [each.path for each in recording_files(tmp_path)]
    assert len(paths) > 1
    assert record_messages(*paths) == lines(records)
    assert [path.name.split(".", 1)[1] for path in paths[:2]] == ["mcap", "2.mcap"]


def test_two_runs_have_a_file_each(tmp_path: Path) -> None:
    async def main() -> list[MissionResult]:
        async with (
            run_executive(simulated_fleet(), speed=20.0) as control,
            recorded(control, tmp_path),
        ):
            runs = (run_mission_on(control, each) for each in (DRIVE, question()))
            return await asyncio.gather(*runs)

    results = asyncio.run(main())
    for result in results:
        (path,) = tmp_path.glob(f"{result.summary.run}-*.mcap")
        assert record_messages(path) == lines(list(result.stamped))
