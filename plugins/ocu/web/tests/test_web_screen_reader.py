"""What screen readers find of diagrams and maps: names, kinds and states of all that is there."""

import re
from collections import Counter
from collections.abc import Iterable
from xml.etree import ElementTree

import pytest
from playwright.async_api import expect
from web_desk import IN_ONE_LOOP, MISSION, Desk
from web_drawing import Drawing
from web_served import REPOSITORY
from web_spoken import Spoken, until_spoken

pytestmark = IN_ONE_LOOP

BPMN = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
FLOW_NODES = re.compile("(task|event|gateway|subProcess|callActivity)$", re.IGNORECASE)
UNNAMED = {"startEvent": "Start", "parallelGateway": "Fork or join"}
DIAGRAM = "Diagram: Tab goes from element to element"


def elements() -> list[str]:
    """Each of the mission's file: its name and kind."""
    root = ElementTree.parse(REPOSITORY / "missions" / f"{MISSION}.bpmn").getroot()
    return [
        f"{' '.join(each.get('name', UNNAMED.get(local(each), '')).split())}, {kind(each)}"
        for process in root.iter(f"{BPMN}process")
        for each in process.iter()
        if each.tag.startswith(BPMN) and FLOW_NODES.search(each.tag)
    ]


def local(element: ElementTree.Element) -> str:
    return element.tag.removeprefix(BPMN)


def kind(element: ElementTree.Element) -> str:
    """As BPMN calls it: "signal boundary event"."""
    about = [local(each) for each in element if each.tag.endswith("EventDefinition")]
    (event,) = about or [""]
    return words(f"{event.removesuffix('EventDefinition')} {local(element)}").strip()


def words(name: str) -> str:
    return re.sub("(?<=[a-z])(?=[A-Z])", " ", name).lower()


def has_each(found: Iterable[str], wanted: Iterable[str]) -> bool:
    return not Counter(wanted) - Counter(found)


async def test_each_element_of_the_editor_has_name_kind_and_problems(desk: Desk) -> None:
    page = await desk.edit()

    def symbols(tree: Spoken) -> list[str]:
        return tree.find("application", DIAGRAM).names("image")

    tree = await until_spoken(page, lambda tree: has_each(symbols(tree), elements()))
    assert len(elements()) == 18
    flow = "continue, sequence flow from Decision? to DETECTION"
    assert {"VIGNETTE1, participant", "Route prompt, data object reference", flow} <= set(
        symbols(tree)
    )
    assert all(symbols(tree)), "a symbol has no name"
    await Drawing(page).select("Reverse")
    await Drawing(page).fill("Distance", "10 s")
    await until_spoken(page, lambda tree: "REVERSE, script task, 1 problem" in symbols(tree))


async def test_tab_says_at_which_element_of_the_editor_it_is(desk: Desk) -> None:
    page = await desk.edit()
    svg = page.get_by_role("application", name=DIAGRAM)
    await svg.focus()
    passed: list[str] = []
    for wanted in ("VIGNETTE1, participant", "DETECTION, participant", "Start, start event"):
        await page.keyboard.press("Tab")
        tree = await until_spoken(
            page, lambda tree: tree.find("application", DIAGRAM).active not in ("", *passed[-1:])
        )
        passed.append(tree.find("application", DIAGRAM).active)
        assert passed[-1] == wanted
        await expect(svg).to_be_focused()


IN_A_RUN = {
    "diagram": ("graphics-document", "Diagram", "image"),
    "tree": ("tree", "Elements", "treeitem"),
}
STATES = [
    "Start, start event, done, once",
    "USER SEND ROUTE, user task, done, once",
    "DRIVE ROUTE, script task, active, once",
    "REVERSE, script task, not visited",
]


@pytest.mark.parametrize("where", IN_A_RUN)
async def test_each_element_of_a_run_has_name_kind_and_state(desk: Desk, where: str) -> None:
    page = await desk.driving()
    role, name, each_role = IN_A_RUN[where]

    def found(tree: Spoken) -> list[str]:
        return tree.find(role, name).names(each_role)

    tree = await until_spoken(page, lambda tree: has_each(found(tree), STATES))
    for each in elements():
        assert any(one.startswith(f"{each}, ") for one in found(tree)), (each, found(tree))
    assert all(found(tree)), "one has no name"


async def test_each_vehicle_on_the_map_of_a_run_has_name_health_and_place(desk: Desk) -> None:
    page = await desk.driving()
    vehicles = (await desk.ask("GET", "/api/fleet"))["vehicles"]
    said = [
        re.compile(
            rf"{re.escape(each['id'])}: OK, at -?\d+\.\d{{6}}°, -?\d+\.\d{{6}}°(, heading \d+°)?"
        )
        for each in vehicles
    ]

    def listed(tree: Spoken) -> list[str]:
        found = tree.find("list", "Vehicles on the map")
        return [
            " ".join(each.names("StaticText")) for each in found.all() if each.role == "listitem"
        ]

    tree = await until_spoken(
        page,
        lambda tree: all(any(each.fullmatch(one) for one in listed(tree)) for each in said),
    )
    assert len(listed(tree)) == len(vehicles) > 1
