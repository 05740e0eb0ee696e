"""Routes, areas and points that a mission file has itself."""

import pytest
from bpmn_text import definitions, findings, line_of, load

from m2pem.mission.geometry import Area, Point, Route

ROUTE = '{"type": "LineString", "coordinates": [[7, 50], [7.001, 50.002, 30]]}'
AREA = '{"type": "Polygon", "coordinates": [[[7, 50], [7.1, 50], [7.1, 50.1], [7, 50]]]}'
GATE = (
    '{"type": "Feature", "properties": {"altitude_frame": "amsl"}, '
    '"geometry": {"type": "Point", "coordinates": [7, 50, 120]}}'
)


def with_geometries(*content: str, process: str = "P") -> str:
    lines = "\n".join(content)
    return (
        f'<process id="{process}">\n<extensionElements>\n{lines}\n</extensionElements>\n'
        f"{line_of()}\n</process>"
    )


def geometry(name: str, text: str) -> str:
    return f'<m2pem:geometry name="{name}">{text}</m2pem:geometry>'


def test_a_mission_has_routes_areas_and_points() -> None:
    written = with_geometries(
        geometry("lane", ROUTE), geometry("field", AREA), geometry("gate", GATE)
    )
    mission = load(definitions(written))
    ring = ((50.0, 7.0, None), (50.0, 7.1, None), (50.1, 7.1, None), (50.0, 7.0, None))
    assert not mission.warnings
    assert mission.geometries == {
        "lane": Route(((50.0, 7.0, None), (50.002, 7.001, 30.0))),
        "field": Area((ring,)),
        "gate": Point((50.0, 7.0, 120.0), "amsl"),
    }


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (geometry("lane", "no"), "geometry 'lane' is not a JSON object"),
        (geometry("lane", ""), "geometry 'lane' is not a JSON object"),
        (geometry("lane", "[" * 100_000), "geometry 'lane' is not a JSON object"),
        (geometry("lane", '{"type": "Point", "coordinates": [7, 95]}'), "latitude 95"),
        (geometry("", ROUTE), "no name"),
        (geometry("a b", ROUTE), "no name that tasks can use: 'a b'"),
        (f"{geometry('lane', ROUTE)}\n{geometry('lane', AREA)}", "two geometries are named 'lane'"),
    ],
)
def test_one_that_cannot_be_used_is_an_error(content: str, says: str) -> None:
    (found,) = findings(definitions(with_geometries(content)))
    assert (found.rule, found.element) == ("bad-geometry", "P")
    assert says in found.message


def test_all_processes_of_a_file_have_one_space_of_names() -> None:
    both = with_geometries(geometry("lane", ROUTE)) + with_geometries(
        geometry("lane", AREA).replace(' id="S"', ' id="S2"'), process="Q"
    ).replace('id="', 'id="q').replace('Ref="', 'Ref="q')
    (found,) = findings(definitions(both))
    assert (found.rule, found.element) == ("bad-geometry", "qQ")


def test_an_edge_that_goes_out_and_back_is_left_out_with_a_warning() -> None:
    spike = AREA.replace("[7.1, 50.1]", "[7.1, 50.1], [7.2, 50.2], [7.1, 50.1]")
    mission = load(definitions(with_geometries(geometry("field", spike))))
    (found,) = mission.warnings
    assert (found.rule, found.element) == ("mended-geometry", "P")
    assert "geometry 'field': its edge from [50.1, 7.1]" in found.message
    assert len(mission.geometries["field"].rings[0]) == 4
