"""What is drawn is what bpmn-js draws: same elements, same places. Its pictures are in the docs."""

import re
from pathlib import Path

import pytest
from lxml import etree

from m2pem.diagram.planes import pictures_of

REPOSITORY = Path(__file__).parents[2]
SVG = "{http://www.w3.org/2000/svg}"
_MATRIX = re.compile(r"matrix\(1 0 0 1 (-?[\d.]+) (-?[\d.]+)\)")
_NUMBERS = re.compile(r"-?\d+(?:\.\d+)?")
_LABEL = "_label"


def drawn_by_bpmn_js() -> list[tuple[Path, Path]]:
    """Missions with their pictures."""
    missions = [
        (mission, REPOSITORY / "docs" / "images" / f"{mission.stem}.svg")
        for mission in sorted((REPOSITORY / "missions").glob("*.bpmn"))
    ]
    examples = sorted((REPOSITORY / "examples").glob("*/*.bpmn"))
    return missions + [(each, each.with_suffix(".svg")) for each in examples]


each_picture = pytest.mark.parametrize(
    ("mission", "theirs"), drawn_by_bpmn_js(), ids=lambda path: f"{path.parent.name}-{path.stem}"
)


def visuals(picture: Path, kind: str) -> dict[str, etree._Element]:
    found = {}
    for group in etree.parse(picture).getroot().iter(f"{SVG}g"):
        name = group.get("data-element-id") or ""
        if kind in (group.get("class") or "") and not name.endswith(_LABEL):
            found[name] = group
    return found


def their_bounds(group: etree._Element) -> tuple[float, ...]:
    moved = _MATRIX.fullmatch(group.get("transform") or "")
    area = next(
        each for each in group if each.tag == f"{SVG}rect" and "djs-hit" in str(each.get("class"))
    )
    assert moved is not None
    size = (area.get("width"), area.get("height"))
    return tuple(float(each or 0) for each in (*moved.groups(), *size))


def their_ends(group: etree._Element) -> tuple[float, ...]:
    path = next(each for each in group.iter(f"{SVG}path") if "marker" in str(each.get("style")))
    numbers = [float(each) for each in _NUMBERS.findall(str(path.get("d")))]
    return (*numbers[:2], *numbers[-2:])


@each_picture
@pytest.mark.tried_with(
    "bpmn-js",
    "draws the missions that m2pem draws",
    kind="BPMN editors",
    result="the same symbols at the same places",
)
def test_the_same_symbols_stand_at_the_same_places(mission: Path, theirs: Path) -> None:
    (picture,) = pictures_of(mission.read_bytes())
    ours = {
        shape.id: (shape.bounds.x, shape.bounds.y, shape.bounds.width, shape.bounds.height)
        for shape in picture.shapes
    }
    expected = visuals(theirs, "djs-shape")
    assert ours.keys() == expected.keys()
    for name, group in expected.items():
        assert ours[name] == pytest.approx(their_bounds(group), abs=0.6), name


@each_picture
def test_the_same_lines_begin_and_end_at_the_same_places(mission: Path, theirs: Path) -> None:
    (picture,) = pictures_of(mission.read_bytes())
    expected = visuals(theirs, "djs-connection")
    assert {line.id for line in picture.lines} == expected.keys()
    for line in picture.lines:
        if line.kind == "sequenceFlow":
            ends = (*line.points[0], *line.points[-1])
            assert ends == pytest.approx(their_ends(expected[line.id]), abs=0.6), line.id
