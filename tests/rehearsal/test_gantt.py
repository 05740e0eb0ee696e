"""Gantt charts: well-formed, complete and legible."""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from m2pem.api.runs import StampedRecord
from m2pem.diagram.style import width_of
from m2pem.engine import records as r
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.fleet.fleet_file import load_fleet
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.plugins import PluginManager
from m2pem.rehearsal.gantt import BARS, LEFT, RIGHT, SIZE, WIDTH, gantt_svg
from m2pem.rehearsal.rehearsal import rehearse
from m2pem.rehearsal.timeline import Outcome

REPOSITORY = Path(__file__).parents[2]
SVG = "{http://www.w3.org/2000/svg}"
TASK = (1, "P", "Drive", 1)


def stamped(*records: tuple[float, r.Record]) -> list[StampedRecord]:
    return [StampedRecord("r1", seq, t_s, record) for seq, (t_s, record) in enumerate(records, 1)]


def drives(*times: tuple[float, float], error: str = "") -> list[StampedRecord]:
    """Behaviors of vehicle `a`, each from one time to another."""
    state = BehaviorState.FAILED if error else BehaviorState.SUCCEEDED
    records: list[tuple[float, r.Record]] = []
    for number, (start_s, end_s) in enumerate(times, 1):
        name = f"r1.b{number}"
        request = r.BehaviorRequested(*TASK, name, "goto", "vehicle", ("a",), {}, {})
        records += [(start_s, request), (end_s, r.BehaviorEnded(*TASK, name, state, error))]
    return stamped(*sorted(records, key=lambda item: item[0]))


def drawn(records: Sequence[StampedRecord], fleet: Fleet | None = None) -> ET.Element:
    return ET.fromstring(gantt_svg(records, fleet))


def texts(svg: ET.Element) -> list[str]:
    return [each.text or "" for each in svg.iter(f"{SVG}text")]


def bars(svg: ET.Element, outcome: Outcome) -> list[ET.Element]:
    """The bars of an outcome; the one of the legend comes last."""
    return [each for each in svg.iter(f"{SVG}rect") if each.get("fill") == BARS[outcome][0]]


@pytest.fixture(scope="module")
def vignette() -> ET.Element:
    fleet = load_fleet(REPOSITORY / "fleet_configs" / "vignette1.yaml")
    result = rehearse(
        REPOSITORY / "missions" / "vignette1.bpmn",
        fleet,
        plugins=PluginManager(block=("all",)),
        answers=REPOSITORY / "missions" / "answers" / "vignette1_detection.yaml",
    )
    return drawn(result.records, fleet)


def test_every_vehicle_and_payload_has_a_row(vignette: ET.Element) -> None:
    shown = texts(vignette)
    rows = ["prompts", "services", "evsg1", "gpr", "evsg2", "ptz", "evsg3", "lead"]
    assert [each for each in shown if each in rows] == rows
    assert shown.count("manned") == 1


def test_bars_have_the_colour_of_their_outcome_and_say_what_and_where(
    vignette: ET.Element,
) -> None:
    found = Counter({outcome: len(bars(vignette, outcome)) - 1 for outcome in Outcome})
    assert +found == {Outcome.SUCCEEDED: 4, Outcome.INTERRUPTED: 1, Outcome.ANSWERED: 2}
    shown = texts(vignette)
    for label in ("single_vehicle_routing", "DriveRoute", "drive_stop", "reverse", "continue"):
        assert label in shown
    titles = [each.text for each in vignette.iter(f"{SVG}title")]
    assert "DriveRoute: single_vehicle_routing (0 s to 9 s, interrupted)" in titles


def test_what_was_thrown_is_marked(vignette: ET.Element) -> None:
    assert {"ThrowStop", "EndDetected", "signal", "escalation"} <= set(texts(vignette))


def test_the_title_says_how_and_when_the_run_ended(vignette: ET.Element) -> None:
    process, about = texts(vignette)[:2]
    assert process == "VIGNETTE1"
    assert about.startswith("terminated after 15.1 s, started 2026-01-01 00:00:00 UTC")


def test_a_bar_is_where_its_time_is() -> None:
    svg = drawn([*drives((10.0, 30.0)), *stamped((40.0, r.InputIgnored("late")))])
    bar = bars(svg, Outcome.SUCCEEDED)[0]
    assert float(bar.get("x", "")) == pytest.approx(LEFT + (RIGHT - LEFT) / 4)
    assert float(bar.get("width", "")) == pytest.approx((RIGHT - LEFT) / 2)


@pytest.mark.parametrize(
    ("end_s", "labels"),
    [
        (0.0, ["0 s"]),
        (9.0, ["0 s", "1 s", "9 s"]),
        (600.0, ["0 s", "60 s", "2:00", "10:00"]),
        (30_000.0, ["0 s", "1:00:00", "8:00:00"]),
        (86_400.0 * 100, ["0 s", "192:00:00", "2304:00:00"]),
    ],
)
def test_the_axis_has_a_legible_number_of_round_times(end_s: float, labels: list[str]) -> None:
    svg = drawn(stamped((0.0, r.RunStarted("P", 0)), (end_s, r.InputIgnored("late"))))
    shown = [e.text or "" for e in svg.iter(f"{SVG}text") if e.get("text-anchor") == "middle"]
    assert [each for each in shown if each in labels] == labels
    assert len(shown) <= 15


def test_bars_that_overlap_stand_below_each_other() -> None:
    svg = drawn(drives((0.0, 10.0), (5.0, 15.0), (10.0, 20.0)))
    rows = [float(bar.get("y", "")) for bar in bars(svg, Outcome.SUCCEEDED)[:-1]]
    assert rows[0] == rows[2] < rows[1]


def test_labels_stay_inside_and_apart() -> None:
    times = [(0.0, 0.0), (0.5, 60.0), (60.0, 60.5), (61.0, 90.0), (94.0, 94.5), (99.9, 100.0)]
    svg = drawn(drives(*times, error="ROUTE_BLOCKED"))
    extents = []
    for text in svg.iter(f"{SVG}text"):
        shown = text.text or ""
        if shown.startswith("go"):
            x, width = float(text.get("x", "")), width_of(shown, SIZE)
            extents.append((x - width, x) if text.get("text-anchor") == "end" else (x, x + width))
    extents.sort()
    assert len(extents) >= 4
    assert all(start >= LEFT and end <= WIDTH for start, end in extents)
    assert all(end <= start for (_, end), (start, _) in pairwise(extents))


def test_any_text_of_a_vehicle_gives_a_well_formed_document() -> None:
    nasty = 'a<b> & "c"\x00\x1b[31m\ud800 \N{SNOWMAN}'
    svg = drawn(stamped((1.0, r.ErrorThrown(*TASK, nasty, nasty)), (2.0, r.InputIgnored(""))))
    assert any('a<b> & "c"' in text and "\N{SNOWMAN}" in text for text in texts(svg))


def test_a_run_without_records_is_drawn_too() -> None:
    vehicle = Vehicle(ResourceId("a"), Domain.GROUND, "sim", {})
    svg = drawn([], Fleet("f", "f", {vehicle.id: vehicle}))
    assert "a" in texts(svg)


def test_a_resource_that_the_fleet_lacks_is_shown_with_what_it_did() -> None:
    assert "a" in texts(drawn(drives((0.0, 1.0))))


def test_the_same_records_give_the_same_document() -> None:
    records = drives((0.0, 10.0), (5.0, 15.0))
    assert gantt_svg(records, None) == gantt_svg(records, None)
