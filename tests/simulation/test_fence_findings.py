"""What `check` finds of the fence before a mission starts."""

import itertools
import json
from pathlib import Path

import pytest
import shapely

from m2pem.findings import Finding, Severity
from m2pem.fleet.fleet_file import load_fleet
from m2pem.geo.local_frame import LocalFrame
from m2pem.scripting.sources import load_mission
from m2pem.simulation.fencing import fence_findings
from tests.simulation.conftest import place
from tests.simulation.test_estimates import HEAD, TAIL, flows, task
from tests.simulation.test_fencing import YARD

FLEET = """version: 1
origin: {{lat: {0}, lon: {1}, alt: 0}}
vehicles:
  v: {{domain: ground, arbiter: sim, connection: {{home: [{2}, {3}, 0]}}}}
areas: {{yard: yard.geojson}}
fence: yard
"""


def written(
    folder: Path,
    tasks: list[tuple[str, str, str]],
    more: str = "",
    home: tuple[float, float] = (20, 100),
) -> tuple[Path, Path]:
    """The files of a mission of tasks in a row (behavior, its parameter and that one's value), and
    of its fleet."""
    rings = [
        [list(place(x, y)[1::-1]) for x, y, *_ in ring.coords]
        for ring in (YARD.exterior, *YARD.interiors)
    ]
    (folder / "yard.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": rings}))
    path = folder / "fleet.yaml"
    path.write_text(FLEET.format(*place(0, 0)[:2], *place(*home)[:2]))
    names = ["S", *(f"T{number}" for number in range(len(tasks))), "E"]
    nodes = '<startEvent id="S"/><endEvent id="E"/>' + "".join(
        task(id_, behavior, "v", **{name: value})
        for id_, (behavior, name, value) in zip(names[1:], tasks, strict=False)
    )
    mission = folder / "mission.bpmn"
    mission.write_text(HEAD + nodes + more + flows(*itertools.pairwise(names)) + TAIL)
    return mission, path


def checked(
    folder: Path,
    tasks: list[tuple[str, str, str]],
    more: str = "",
    home: tuple[float, float] = (20, 100),
) -> list[Finding]:
    mission, fleet = written(folder, tasks, more, home)
    return fence_findings(load_mission(mission.read_bytes()), load_fleet(fleet))


def at(east: float, north: float) -> str:
    latitude, longitude, _ = place(east, north)
    return f"[{latitude}, {longitude}]"


def test_a_target_outside_is_an_error_with_the_place_and_the_distance(tmp_path: Path) -> None:
    (found,) = checked(tmp_path, [("goto", "target", at(250, 100))])
    latitude, longitude, _ = place(250, 100)
    assert (found.severity, found.rule, found.element) == (Severity.ERROR, "outside-fence", "T0")
    assert f"v: the target, [{latitude:.6f}, {longitude:.6f}], is 50 m outside" in found.message
    assert found.place == pytest.approx((latitude, longitude))


def test_the_way_from_home_and_from_the_task_before_is_known(tmp_path: Path) -> None:
    assert not checked(tmp_path, [("goto", "target", at(60, 20)), ("goto", "target", at(60, 180))])
    (found,) = checked(tmp_path, [("goto", "target", at(180, 100))])
    assert found.severity is Severity.WARNING  # it may begin elsewhere than at its home
    assert "the way to the target leaves the fleet's fence by 20 m" in found.message
    assert found.place == pytest.approx(place(100, 100)[:2], abs=1e-6)  # the middle of the hole
    (found,) = [
        each
        for each in checked(
            tmp_path,
            [
                ("goto", "target", at(60, 180)),
                ("goto", "target", at(180, 180)),
                ("hold", "duration", "3 s"),
                ("goto", "target", at(180, 20)),
                ("goto", "target", at(20, 180)),
            ],
        )
        if each.severity is Severity.ERROR
    ]
    assert found.element == "T4"


def test_where_ways_meet_nothing_is_supposed_of_the_start(tmp_path: Path) -> None:
    """The second task may also begin elsewhere."""
    more = '<startEvent id="S2"/>' + flows(("S2", "T0"))
    found = checked(tmp_path, [("goto", "target", at(180, 100))], more)
    assert [each.rule for each in found] == ["return-leaves-fence"]


def test_a_return_that_would_cross_a_hole_is_a_warning_before(tmp_path: Path) -> None:
    found = checked(tmp_path, [("goto", "target", at(60, 180)), ("goto", "target", at(100, 180))])
    assert found == []
    (found_,) = checked(
        tmp_path,
        [
            ("goto", "target", at(60, 180)),
            ("goto", "target", at(180, 150)),
            ("goto", "target", at(180, 100)),
        ],
    )
    assert (found_.severity, found_.rule) == (Severity.WARNING, "return-leaves-fence")
    assert "the way to its home leaves the fleet's fence by 16 m" in found_.message
    inside = LocalFrame(place(0, 0)[:2]).to_local(found_.place)
    assert shapely.Point(inside).distance(YARD) == pytest.approx(16, abs=0.5)
    assert f"at [{found_.place[0]:.6f}, {found_.place[1]:.6f}]" in found_.message


def test_a_home_outside_is_named(tmp_path: Path) -> None:
    (found,) = checked(tmp_path, [("goto", "target", at(60, 100))], home=(-0.5, 100))
    assert "its home, [" in found.message
    assert "is 0.5 m outside the fleet's fence" in found.message
    (found,) = checked(tmp_path, [("goto", "target", at(180, 100))], home=(-0.5, 100))
    assert (found.severity, found.rule) == (Severity.WARNING, "outside-fence")  # across the hole


def drawn(folder: Path, nodes: str, *ways: tuple[str, str]) -> list[tuple[str, str, Severity]]:
    """The findings of a mission as it is drawn: task, rule and severity."""
    mission, fleet = written(folder, [])
    mission.write_text(HEAD + nodes + flows(*ways) + TAIL)
    found = fence_findings(load_mission(mission.read_bytes()), load_fleet(fleet))
    return [(each.element, each.rule, each.severity) for each in found]


ENDS = '<startEvent id="S"/><endEvent id="E"/>'


def test_a_vehicle_is_followed_through_gateways_calls_and_joins_that_do_not_move_it(
    tmp_path: Path,
) -> None:
    west, east = (task(name, "goto", "v", target=at(x, 100)) for name, x in (("W", 60), ("A", 180)))
    gateways = '<exclusiveGateway id="X"/><exclusiveGateway id="Y"/>'
    ways = (("S", "W"), ("W", "X"), ("X", "Y"), ("Y", "A"), ("A", "E"))
    other = '<sequenceFlow id="X-Y2" sourceRef="X" targetRef="Y"/>'
    found = drawn(tmp_path, ENDS + west + gateways + other + east, *ways)
    assert found == [("A", "outside-fence", Severity.ERROR)]
    inside = f'<subProcess id="P"><startEvent id="s"/>{east}{flows(("s", "A"))}</subProcess>'
    ways = (("S", "W"), ("W", "P"), ("P", "E"))
    assert drawn(tmp_path, ENDS + west + inside, *ways) == [("A", "outside-fence", Severity.ERROR)]


def test_where_another_task_may_move_it_nothing_is_supposed_of_the_start(tmp_path: Path) -> None:
    west, east = (task(name, "goto", "v", target=at(x, 100)) for name, x in (("W", 60), ("A", 180)))
    fork = '<parallelGateway id="F"/>' + task("B", "goto", "v", target=at(180, 180))
    ways = (("S", "W"), ("W", "F"), ("F", "A"), ("F", "B"), ("A", "E"), ("B", "E"))
    beside = drawn(tmp_path, ENDS + west + fork + east, *ways)
    assert ("A", "outside-fence") not in [each[:2] for each in beside]
    need = task("N", "goto", "v", target=at(60, 20)).replace('vehicle="v"', 'requires="true"')
    ways = (("S", "W"), ("W", "N"), ("N", "A"), ("A", "E"))
    between = drawn(tmp_path, ENDS + west + need + east, *ways)
    assert ("A", "outside-fence") not in [each[:2] for each in between]
    timer = (
        '<boundaryEvent id="T" attachedToRef="W"><timerEventDefinition><timeDuration>PT1S'
        "</timeDuration></timerEventDefinition></boundaryEvent>"
    )
    ways = (("S", "W"), ("W", "E"), ("T", "A"), ("A", "E"))
    interrupted = drawn(tmp_path, ENDS + west + timer + east, *ways)
    assert ("A", "outside-fence") not in [each[:2] for each in interrupted]
