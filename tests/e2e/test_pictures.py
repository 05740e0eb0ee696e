"""The docs' pictures of missions are those of the files as they are. `make pictures` draws them."""

import os
import re
from hashlib import sha256
from pathlib import Path

import pytest
from lxml import etree

REPOSITORY = Path(__file__).parents[2]
IMAGES = REPOSITORY / "docs" / "images"
MISSIONS = sorted((REPOSITORY / "missions").glob("*.bpmn"))
EXAMPLES = sorted((REPOSITORY / "examples").glob("*/*.bpmn"))
TUTORIALS = sorted((REPOSITORY / "docs" / "tutorials").glob("*/*.bpmn"))
BESIDE = (*EXAMPLES, *TUTORIALS)

SVG = "{http://www.w3.org/2000/svg}"
BPMNDI = "{http://www.omg.org/spec/BPMN/20100524/DI}"

every_mission = pytest.mark.parametrize(
    "mission", [*MISSIONS, *BESIDE], ids=lambda path: f"{path.parent.name}-{path.stem}"
)


def image(mission: Path) -> Path:
    """That of an example or a tutorial is beside it."""
    return mission.with_suffix(".svg") if mission in BESIDE else IMAGES / f"{mission.stem}.svg"


def picture(mission: Path) -> etree._Element:
    path = image(mission)
    assert path.exists(), f"{mission.name} has no picture: run `make pictures`"
    return etree.parse(path).getroot()


@every_mission
def test_the_picture_was_drawn_from_the_mission_as_it_is(mission: Path) -> None:
    hashed = sha256(mission.read_bytes()).hexdigest()
    drawn_from = picture(mission).findtext(f"{SVG}metadata")
    assert drawn_from == f"Drawn from {mission.name}, SHA-256 {hashed}", "run `make pictures`"


@every_mission
def test_the_picture_shows_everything_that_the_mission_draws(mission: Path) -> None:
    diagram = etree.parse(mission).getroot()
    planned = {
        element.get("bpmnElement")
        for tag in ("BPMNShape", "BPMNEdge")
        for element in diagram.iter(f"{BPMNDI}{tag}")
    }
    shown = {element.get("data-element-id") for element in picture(mission).iter(f"{SVG}g")}
    assert planned - shown == set()


@every_mission
def test_the_picture_is_shown_in_the_docs(mission: Path) -> None:
    example = mission.with_name("README.md")
    pages = [example] if mission in EXAMPLES else [*(REPOSITORY / "docs").rglob("*.md")]
    shown = [f"]({os.path.relpath(image(mission), page.parent)})" for page in pages]
    texts = [page.read_text(encoding="utf-8") for page in pages]
    assert any(each in text for each, text in zip(shown, texts, strict=True))


def test_no_picture_is_left_of_a_mission_that_is_gone() -> None:
    stems = {mission.stem for mission in MISSIONS}
    drawn = [path for path in IMAGES.glob("*.svg") if "Drawn from" in path.read_text("utf-8")]
    assert [path.name for path in drawn if path.stem not in stems] == []
    beside = (REPOSITORY / "examples").glob("*/*.svg")
    assert [path for path in beside if path.with_suffix(".bpmn") not in EXAMPLES] == []


def test_pictures_do_not_reach_out_to_the_network() -> None:
    reaching = re.compile(r'(?:href|src)="(?!#)|url\((?!["\']?(?:&quot;)?#)')
    images = sorted([*IMAGES.glob("*.svg"), *map(image, BESIDE)])
    assert [path.name for path in images if reaching.search(path.read_text("utf-8"))] == []
