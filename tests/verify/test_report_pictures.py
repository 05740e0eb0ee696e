"""A run that passes processes of other files is drawn in each of them."""

from pathlib import Path

import pytest
from lxml import etree

from m2pem.cli.group import run_command_line
from tests.engine.notation import xml

MAIN = """
<startEvent id="Start"/><userTask id="Ask">ask on</userTask>
<callActivity id="Call" calledElement="LOOK"/><endEvent id="Done"/>
Start -> Ask -> Call -> Done
"""
CALLED = """
<process id="LOOK" isExecutable="true"><startEvent id="Start"/>
<userTask id="Look">ask yes no</userTask><exclusiveGateway id="Which"/><endEvent id="End"/>
Start -> Look -> Which
Which -> End if user.decision == 'yes'
</process>
"""
UNHEARD = """
<process id="LOOK" isExecutable="true"><startEvent id="Start"/>
<intermediateCatchEvent id="Look">signal never</intermediateCatchEvent><endEvent id="End"/>
Start -> Look -> End
</process>
"""


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    (tmp_path / "tour.bpmn").write_text(xml(MAIN), encoding="utf-8")
    (tmp_path / "look.bpmn").write_text(xml(CALLED), encoding="utf-8")
    return tmp_path / "tour.bpmn"


def drawn(file: Path) -> dict[str, str]:
    """The texts at each element of a picture."""
    root = etree.fromstring(file.read_bytes())
    groups = [each for each in root.iter("{*}g") if each.get("data-element-id")]
    return {each.get("data-element-id", ""): " ".join(each.itertext()) for each in groups}


def numbers(file: Path) -> set[int]:
    """The numbers of steps that a picture shows."""
    root = etree.fromstring(file.read_bytes())
    texts = ["".join(each.itertext()).strip() for each in root.iter("{*}text")]
    return {int(part) for text in texts for part in text.split(", ") if part.isdigit()}


def test_a_report_has_a_picture_of_each_file_that_the_run_passes(mission: Path) -> None:
    folder = mission.parent
    report, picture = folder / "found.md", folder / "first.svg"
    element_names = ["verify", str(mission), "--report", str(report), "--report", str(picture)]
    assert run_command_line(element_names) == 1
    own, called = folder / "first.svg", folder / "first-look.svg"
    assert {"Ask", "Call", "Done"} <= drawn(own).keys()
    assert "Look" not in drawn(own)
    assert {"Look", "Which", "End"} <= drawn(called).keys()
    assert "Call" not in drawn(called)
    text = report.read_text(encoding="utf-8")
    one, other = text.index("(found-1.svg)"), text.index("(found-1-look.svg)")
    assert one < other < text.index("1. start event Start")
    assert (folder / "found-1-look.svg").read_bytes() == called.read_bytes()


def test_steps_have_the_same_numbers_in_all_pictures(mission: Path) -> None:
    folder = mission.parent
    assert run_command_line(["verify", str(mission), "--report", str(folder / "first.svg")]) == 1
    own, called = numbers(folder / "first.svg"), numbers(folder / "first-look.svg")
    assert own
    assert called
    assert max(own) < max(called)
    assert own | called >= set(range(1, max(called) + 1))


def test_what_is_wrong_in_another_file_without_a_run_is_drawn_there(mission: Path) -> None:
    folder = mission.parent
    (folder / "look.bpmn").write_text(xml(UNHEARD), encoding="utf-8")
    assert run_command_line(["verify", str(mission), "--report", str(folder / "found.md")]) == 1
    text = (folder / "found.md").read_text(encoding="utf-8")
    section = text[text.index("## can-be-triggered") :].split("\n## ")[0]
    name = section[section.index("(found-") + 1 :].split(")")[0].removesuffix(".svg")
    assert f"({name}-look.svg)" in section
    assert "waits for never" in drawn(folder / f"{name}-look.svg")["Look"]


def test_a_mission_of_one_file_has_one_picture(tmp_path: Path) -> None:
    main = MAIN.replace('<callActivity id="Call" calledElement="LOOK"/>', '<task id="Call"/>')
    file = tmp_path / "alone.bpmn"
    file.write_text(xml(main), encoding="utf-8")
    run_command_line(["verify", str(file), "--report", str(tmp_path / "alone.svg")])
    assert [each.name for each in tmp_path.glob("*.svg")] == ["alone.svg"]
