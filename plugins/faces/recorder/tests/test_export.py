"""Exports of runs, read by the libraries of those who use them."""

import csv
import io
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fastkml
import msgspec
import pyarrow.parquet
import pytest
import shapely
import shapely.geometry
from fastkml.enums import AltitudeMode
from m2pem_plugin_recorder.export.xes import XesExporter
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from recording_world import DRIVE, FLEET, GATE, HOME, ROAD, finished, write_fleet
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

from m2pem import load_mission
from m2pem.api import (
    ExportedRecord,
    ExportedRun,
    ExportOptions,
    Point,
    RunStatus,
    RunSummary,
    parse_mission,
)
from m2pem.api import records as r
from m2pem.testing.scenarios import drawn, interrupted, question

ALIKE = ("u-2", "u_2", "2u")
JOURNAL = ("--journal", "journal.db")
ABORTED = interrupted("goto", "ugv1", after="PT2S", target="gate")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Runs r1 and r2 (two tasks each), r3 (a task that is interrupted), r4 (a question)."""
    path = tmp_path_factory.mktemp("export")
    write_fleet(path)
    (path / "aborted.bpmn").write_bytes(ABORTED)
    (path / "question.bpmn").write_bytes(drawn(question(), lane=ROAD, gate=Point(HOME)))
    (path / "answers.yaml").write_text("answers: {Question: [continue]}\n")
    for mission in ("drive", "drive", "aborted"):
        finished(path, *run(mission), "--face", "recorder")
    finished(path, *run("question"), "--answers", "answers.yaml", "--face", "none")
    yield path


def run(mission: str) -> tuple[str, ...]:
    common = ("--fleet", "fleet.yaml", *JOURNAL, "--ocu", "none", "--speed", "20")
    return ("run", f"{mission}.bpmn", *common)


def export(folder: Path, *arguments: str) -> str:
    return finished(folder, "export", *arguments, *JOURNAL)


def journal(folder: Path, run_id: str) -> list[dict[str, Any]]:
    lines = finished(folder, "runs", "--export", run_id, *JOURNAL).splitlines()[1:]
    return [json.loads(line) for line in lines]


def test_a_recording_is_found_in_the_folder_of_the_fleet_file(tmp_path: Path) -> None:
    write_fleet(tmp_path)
    fleet = tmp_path / "fleet.yaml"
    named = "recorder: {folder: elsewhere, min_free_mb: 0}"
    fleet.write_text(FLEET.replace("recorder: {min_free_mb: 0}", named))
    finished(tmp_path, *run("drive"), "--face", "recorder")
    assert list((tmp_path / "elsewhere").glob("r1-*.mcap"))
    assert "no recording" not in export(tmp_path, "r1", "--to", "mcap", "-o", "r1.mcap")
    with (tmp_path / "r1.mcap").open("rb") as file:
        topics = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert topics >= {"/m2pem/telemetry", "/m2pem/records"}
    # One of which the file does not say it any more is looked for beside the journal.
    (tmp_path / "elsewhere").rename(tmp_path / "journal.db-recordings")
    assert "no recording" not in export(tmp_path, "r1", "--to", "kml", "-o", "r1.kml")
    (tmp_path / "journal.db-recordings").rename(tmp_path / "away")
    printed = export(tmp_path, "r1", "--to", "kml", "-o", "r1.kml")
    beside = tmp_path / "journal.db-recordings"
    assert f"there is no recording in elsewhere or {beside} (--recordings names" in printed


# --- XES --------------------------------------------------------------------------------------


def log_of(path: Path) -> Any:
    """Return a log as a table (pandas)."""
    import pm4py  # 2 s and 200 MB in each process that collects the tests

    return pm4py.convert_to_dataframe(pm4py.read_xes(str(path)))


def test_the_traces_of_a_log_are_the_runs(folder: Path) -> None:
    export(folder, "--all", "--to", "xes", "-o", "all.xes")
    log = log_of(folder / "all.xes")
    assert list(log["case:concept:name"].unique()) == ["r1", "r2", "r3", "r4"]
    assert list(log["case:m2pem:outcome"].unique()) == ["completed"]
    for run_id in ("r1", "r2", "r3", "r4"):
        trace = log[log["case:concept:name"] == run_id]
        names = load_mission(folder / _mission_of(run_id)).elements
        tasks = {key for key, each in names.items() if type(each).__name__.endswith("Task")}
        wanted = [
            (each["element"], "start" if each["record"] == "TokenEntered" else each["outcome"])
            for each in journal(folder, run_id)
            if each["record"] in ("TokenEntered", "TokenLeft") and each["element"] in tasks
        ]
        ends = {"completed": "complete", "interrupted": "ate_abort", "start": "start"}
        assert wanted
        assert list(zip(trace["m2pem:element"], trace["lifecycle:transition"], strict=True)) == [
            (element, ends[what]) for element, what in wanted
        ]
        assert trace["time:timestamp"].is_monotonic_increasing
    assert (log[log["case:concept:name"] == "r3"]["lifecycle:transition"] == "ate_abort").any()


def _mission_of(run_id: str) -> str:
    return {"r3": "aborted.bpmn", "r4": "question.bpmn"}.get(run_id, "drive.bpmn")


def test_times_and_durations_are_those_of_the_records(folder: Path) -> None:
    export(folder, "r1", "--to", "xes", "-o", "r1.xes")
    log = log_of(folder / "r1.xes")
    records = {(e["record"], e.get("element")): e["t"] for e in journal(folder, "r1")}
    first, last = log.iloc[0], log.iloc[-1]
    took = (last["time:timestamp"] - first["time:timestamp"]).total_seconds()
    wanted = records["TokenLeft", "Task2"] - records["TokenEntered", "Task1"]
    assert took == pytest.approx(wanted, abs=0.002)


def test_who_did_what_is_the_resource(folder: Path) -> None:
    export(folder, "--all", "--to", "xes", "-o", "all.xes")
    log = log_of(folder / "all.xes")
    done = log[log["lifecycle:transition"] == "complete"].set_index("case:concept:name")
    assert set(done.loc["r1"]["org:resource"]) == {"ugv1"}
    (answer,) = (e for e in journal(folder, "r4") if e["record"] == "PromptAnswered")
    assert done.loc["r4"]["org:resource"] == answer["by"]


@pytest.mark.tried_with(
    "PM4Py",
    "reads the XES export and discovers a process",
    kind="Recordings and analysis",
    result="fits the runs",
    package="pm4py",
)
def test_the_process_that_is_discovered_fits_the_runs(folder: Path) -> None:
    import pm4py  # as above

    export(folder, "r1", "r2", "--to", "xes", "-o", "two.xes")
    log = log_of(folder / "two.xes")
    complete = log[log["lifecycle:transition"] == "complete"]
    net, begin, end = pm4py.discover_petri_net_inductive(complete)
    assert {each.label for each in net.transitions if each.label} == {"Task1", "Task2"}
    fitness = pm4py.fitness_token_based_replay(complete, net, begin, end)
    assert fitness["log_fitness"] == 1.0


def test_a_pause_suspends_what_is_under_way_and_a_stop_aborts_it() -> None:
    mission = parse_mission(DRIVE, "drive.bpmn")
    at = {"token": 1, "process": "SCENARIO", "element": "Task1", "scope": 1}
    records = [
        r.RunStarted("SCENARIO", 0),
        r.TokenEntered(**at),
        r.RunPaused(2_000_000),
        r.RunResumed(3_000_000),
        r.RunEnded(r.RunOutcome.STOPPED, "by ann"),
    ]
    stamped = [ExportedRecord(n + 1, n * 1_000_000, n, each) for n, each in enumerate(records)]
    summary = RunSummary("r9", "drive.bpmn", "SCENARIO", RunStatus.STOPPED, 0)
    output = io.BytesIO()
    exporter = XesExporter(output, ExportOptions())
    exporter.add(ExportedRun(summary, stamped, mission))
    exporter.close()
    transitions = [
        line.split('value="')[1].split('"')[0]
        for line in output.getvalue().decode().split("<trace>")[1].splitlines()
        if "lifecycle:transition" in line
    ]
    assert transitions == ["start", "suspend", "resume", "pi_abort"]


# --- tables -----------------------------------------------------------------------------------


def test_csv_has_a_row_for_each_record(folder: Path) -> None:
    rows = list(csv.DictReader(export(folder, "r1", "--to", "csv").splitlines()))
    records = journal(folder, "r1")
    assert [int(row["seq"]) for row in rows] == [each["seq"] for each in records]
    for row, record in zip(rows, records, strict=True):
        assert row["record"] == record["record"]
        assert float(row["mission_time_s"]) == record["t"]
        assert json.loads(row["content"]).items() <= record.items()


@pytest.mark.tried_with(
    "Apache Arrow",
    "reads the Parquet export",
    kind="Recordings and analysis",
    result="the rows of the CSV, with types",
    package="pyarrow",
)
def test_parquet_has_the_same_rows_with_types(folder: Path) -> None:
    for table in ("records", "telemetry"):
        export(folder, "r1", "r2", "--to", "parquet", "--table", table, "-o", f"{table}.parquet")
        text = export(folder, "r1", "r2", "--to", "csv", "--table", table)
        rows = list(csv.DictReader(text.splitlines()))
        read = pyarrow.parquet.read_table(folder / f"{table}.parquet")
        assert read.column_names == list(rows[0])
        assert read.num_rows == len(rows) > 20
        assert str(read.schema.field("time_utc").type) == "timestamp[us, tz=UTC]"
        assert set(read["run"].to_pylist()) == {"r1", "r2"}
    latitudes = [float(row["latitude_deg"]) for row in rows]
    assert read["latitude_deg"].to_pylist() == latitudes
    assert max(latitudes) == pytest.approx(GATE[0], abs=2e-5)


def test_telemetry_that_was_not_recorded_is_said_to_be_missing(folder: Path) -> None:
    printed = export(folder, "r4", "--to", "csv", "--table", "telemetry")
    where = f"r4: there is no recording in {folder / 'journal.db-recordings'} (--recordings names"
    assert f"m2pem: {where} another folder); there is no telemetry" in printed


def test_tracks_of_the_web_page_stand_in_for_a_recording(folder: Path, tmp_path: Path) -> None:
    printed = export(folder, "r1", "--to", "geojson", "--recordings", str(tmp_path))
    assert "there is no recording" in printed
    started_us = next(e["started_us"] for e in journal(folder, "r1") if e["record"] == "RunStarted")
    tracks = folder / "journal.db-tracks"
    tracks.mkdir()
    place = {"latitude_deg": 38.0, "longitude_deg": -77.0, "altitude_m": 9.0}
    state = {"resource": "ugv1", "time_us": started_us + 1, "position": place}
    lines = [{"run": "r1", "started_us": started_us}, {"t": 1.0, "vehicles": {"ugv1": state}}]
    (tracks / "r1.jsonl").write_bytes(b"".join(msgspec.json.encode(e) + b"\n" for e in lines))
    options = ("--table", "telemetry", "--recordings", str(tmp_path))
    printed = export(folder, "r1", "--to", "csv", *options, "-o", "tracked.csv")
    assert "positions are those that the web page kept" in printed
    (row,) = csv.DictReader((folder / "tracked.csv").read_text().splitlines())
    assert (row["resource"], float(row["latitude_deg"])) == ("ugv1", 38.0)


# --- maps -------------------------------------------------------------------------------------


@pytest.mark.tried_with(
    "Shapely",
    "reads the GeoJSON export",
    kind="Recordings and analysis",
    result="tracks and places",
    package="shapely",
)
def test_geojson_has_tracks_and_places(folder: Path) -> None:
    export(folder, "r1", "--to", "geojson", "-o", "r1.geojson")
    features = json.loads((folder / "r1.geojson").read_text())["features"]
    shapes = {each["properties"]["name"]: each for each in features}
    gate = shapely.geometry.shape(shapes["gate"]["geometry"])
    track = shapely.geometry.shape(shapes["ugv1"]["geometry"])
    assert isinstance(track, shapely.LineString)
    assert gate.coords[0][:2] == (GATE[1], GATE[0])
    assert track.distance(gate) < 1e-4
    assert len(shapes["ugv1"]["properties"]["coordTimes"]) == len(track.coords)
    assert track.coords[-1][:2] == pytest.approx((HOME[1], HOME[0]), abs=1e-4)


def test_what_the_mission_has_drawn_is_on_the_map(folder: Path) -> None:
    """In place of what the fleet has under the same name, as for the run's tasks."""
    export(folder, "r4", "--to", "geojson", "-o", "r4.geojson")
    features = json.loads((folder / "r4.geojson").read_text())["features"]
    shapes = {each["properties"]["name"]: each["geometry"] for each in features}
    assert shapes["lane"]["coordinates"] == [[each[1], each[0]] for each in ROAD.waypoints]
    assert shapes["gate"]["coordinates"] == [HOME[1], HOME[0]]
    export(folder, "r4", "--to", "kml", "-o", "r4.kml")
    (runs,) = fastkml.KML.parse(folder / "r4.kml").features[0].features
    assert "lane" in [each.name for each in runs.features]
    export(folder, "r4", "--to", "mcap", "-o", "r4_drawn.mcap")
    with (folder / "r4_drawn.mcap").open("rb") as file:
        (scene, *_) = [m.data for _, _, m in make_reader(file).iter_messages("/m2pem/geometries")]
    assert b'"lane"' in scene


@pytest.mark.tried_with(
    "fastkml",
    "reads the KML export",
    kind="Recordings and analysis",
    result="tracks and places",
    package="fastkml",
)
def test_kml_has_tracks_and_places(folder: Path) -> None:
    export(folder, "r1", "r2", "--to", "kml", "-o", "runs.kml")
    document = fastkml.KML.parse(folder / "runs.kml").features[0]
    assert [each.name for each in document.features] == ["r1 drive.bpmn", "r2 drive.bpmn"]
    placemarks = {each.name: each for each in document.features[0].features}
    assert set(placemarks) == {"gate", "home", "mast", "ugv1", "ugv2"}
    assert placemarks["gate"].geometry.coords[0][:2] == (GATE[1], GATE[0])
    assert placemarks["gate"].kml_geometry.altitude_mode == AltitudeMode.clamp_to_ground
    assert placemarks["mast"].geometry.coords[0][2] == pytest.approx(93.97, abs=0.01)
    assert placemarks["mast"].kml_geometry.altitude_mode == AltitudeMode.absolute
    times = [item.when.dt for item in placemarks["ugv1"].kml_geometry.track_items]
    assert times == sorted(times)
    assert len(times) > 10


# --- MCAP -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("run_id", "has_telemetry"), [("r1", True), ("r4", False)])
def test_mcap_has_all_records_and_the_telemetry_of_the_recording(
    folder: Path, run_id: str, has_telemetry: bool
) -> None:
    export(folder, run_id, "--to", "mcap", "-o", f"{run_id}.mcap")
    with (folder / f"{run_id}.mcap").open("rb") as file:
        reader = make_reader(file)
        records = [json.loads(m.data) for _, _, m in reader.iter_messages("/m2pem/records")]
        topics = {channel.topic for _, channel, _ in reader.iter_messages()}
        names = {each.name for each in reader.iter_attachments()}
    assert records == journal(folder, run_id)
    assert ("/ugv1/location" in topics) is has_telemetry
    assert "fleet.json" in names


def test_mcap_holds_one_run(folder: Path) -> None:
    printed = finished(
        folder, "export", "r1", "r2", "--to", "mcap", "-o", "two.mcap", *JOURNAL, status=1
    )
    assert "an MCAP file holds one run" in printed
    assert not (folder / "two.mcap").exists()


# --- the command ------------------------------------------------------------------------------


def test_a_time_window_chooses_runs(folder: Path) -> None:
    window = ("--all", "--since", "2020-01-01", "--until", "2020-02-01")
    printed = finished(folder, "export", *window, "--to", "csv", *JOURNAL, status=2)
    assert "no such run" in printed
    rows = export(folder, "--all", "--since", "2020-01-01", "--to", "csv").splitlines()
    assert {row["run"] for row in csv.DictReader(rows)} == {"r1", "r2", "r3", "r4"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--to", "csv"), "name the runs to export, or give --all"),
        (("r1", "--all", "--to", "csv"), "name the runs to export, or give --all"),
        (("r1", "--to", "cvs"), "there is no exporter 'cvs'"),
        (("r9", "--to", "csv"), "r9"),
        (("--all", "--since", "noon", "--to", "csv"), "--since 'noon' is not a time"),
        (("r1", "--since", "2020-01-01", "--to", "csv"), "--since and --until go with --all"),
    ],
)
def test_bad_arguments_are_named(folder: Path, arguments: tuple[str, ...], says: str) -> None:
    assert says in finished(folder, "export", *arguments, *JOURNAL, status=2)


# --- a bag of ROS 2 ---------------------------------------------------------------------------


def messages_of_bag(path: Path) -> list[tuple[Connection, int, Any]]:
    """Return all messages of a bag, decoded by the definitions in the bag itself."""
    with AnyReader([path]) as reader:
        assert reader.connections
        for each in reader.connections:
            assert each.msgdef.format is MessageDefinitionFormat.MSG, each
        return [
            (connection, at_ns, reader.deserialize(data, connection.msgtype))
            for connection, at_ns, data in reader.messages()
        ]


@pytest.fixture(scope="module")
def bag(folder: Path) -> Path:
    export(folder, "r1", "--to", "rosbag2", "-o", "bag")
    return folder / "bag"


@pytest.mark.tried_with(
    "rosbags",
    "reads every message of an exported bag",
    kind="ROS 2",
    result="all are read",
    note="it refuses a recording, which has JSON beside CDR",
    package="rosbags",
)
def test_rosbags_reads_every_message_of_a_bag(folder: Path, bag: Path) -> None:
    """rosbags 0.11.9 refuses a recording: "Profile is not ros2."."""
    found = messages_of_bag(bag)
    topics = {connection.topic: connection.msgtype for connection, _, _ in found}
    assert topics == {
        "/m2pem/records": "std_msgs/msg/String",
        "/m2pem/telemetry": "std_msgs/msg/String",
        **{f"/{name}/fix": "sensor_msgs/msg/NavSatFix" for name in ("ugv1", "ugv2")},
        **{f"/{name}/odom": "nav_msgs/msg/Odometry" for name in ("ugv1", "ugv2")},
        **{f"/{name}/battery_state": "sensor_msgs/msg/BatteryState" for name in ("ugv1", "ugv2")},
    }
    records = [json.loads(m.data) for each, _, m in found if each.topic == "/m2pem/records"]
    assert records == journal(folder, "r1")
    odometry = [(at_ns, m) for each, at_ns, m in found if each.topic == "/ugv1/odom"]
    assert len(odometry) > 10
    for at_ns, message in odometry:
        stamp = message.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == at_ns
        assert (message.header.frame_id, message.child_frame_id) == ("map", "ugv1/base_link")
    assert [at_ns for _, at_ns, _ in found] == sorted(at_ns for _, at_ns, _ in found)


def test_a_bag_is_as_rosbag2_of_jazzy_writes_it(bag: Path) -> None:
    """Version 9, MCAP, CDR alone, and for each topic its QoS and the hash of its type."""
    yaml = YAML(typ="safe").load((bag / "metadata.yaml").read_text(encoding="utf-8"))
    information = yaml["rosbag2_bagfile_information"]
    assert (information["version"], information["storage_identifier"]) == (9, "mcap")
    assert information["relative_file_paths"] == ["bag.mcap"]
    assert {each.name for each in bag.iterdir()} == {"metadata.yaml", "bag.mcap"}
    store = get_typestore(Stores.ROS2_JAZZY)
    counts = {}
    for each in information["topics_with_message_count"]:
        topic = each["topic_metadata"]
        counts[topic["name"]] = each["message_count"]
        assert topic["serialization_format"] == "cdr"
        assert topic["type_description_hash"] == store.hash_rihs01(topic["type"])
        (qos,) = topic["offered_qos_profiles"]
        assert (qos["reliability"], qos["durability"]) == ("reliable", "volatile")
    assert sum(counts.values()) == information["message_count"]
    with (bag / "bag.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        read = Counter(channel.topic for _, channel, _, _ in reader.iter_decoded_messages())
    assert read == counts


def test_vehicles_whose_names_are_alike_in_ros_have_topics_of_their_own(tmp_path: Path) -> None:
    write_fleet(tmp_path)
    fleet = tmp_path / "fleet.yaml"
    (line,) = (each for each in FLEET.splitlines(keepends=True) if "ugv2" in each)
    lines = "".join(line.replace("ugv2", name) for name in ALIKE)
    fleet.write_text(FLEET.replace(line, lines))
    finished(tmp_path, *run("drive"), "--face", "recorder")
    export(tmp_path, "r1", "--to", "rosbag2", "-o", "bag")
    odometry = [
        (each.topic, message.child_frame_id)
        for each, _, message in messages_of_bag(tmp_path / "bag")
        if each.msgtype == "nav_msgs/msg/Odometry"
    ]
    topics = {topic: frame.partition("/")[0] for topic, frame in odometry}
    assert len(set(odometry)) == 1 + len(ALIKE)
    assert set(topics.values()) == {"ugv1", *ALIKE}
    assert set(topics) == {"/ugv1/odom", "/u_2/odom", "/u_2/odom_2", "/_2u/odom"}


def test_a_bag_is_not_written_over_another_folder(folder: Path, bag: Path) -> None:
    before = (bag / "metadata.yaml").read_bytes()
    refused = ("--to", "rosbag2", *JOURNAL)
    said = finished(folder, "export", "r2", *refused, "-o", "bag", status=2)
    assert "bag" in said
    assert (bag / "metadata.yaml").read_bytes() == before
    assert "name it with -o" in finished(folder, "export", "r2", *refused, status=2)
    said = finished(folder, "export", "r1", "r2", *refused, "-o", "both", status=1)
    assert "a bag holds one run" in said
    assert not [each for each in folder.iterdir() if "both" in each.name]
