"""The text that Spin is given: readable, and whole."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from m2pem.bpmn import read_mission
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Kind, PetriNet
from m2pem.verify.spin.promela import Assertions, comment, identifiers, text_of
from m2pem.verify.translate import translate
from tests.engine.notation import mission as notation

ROOT = Path(__file__).parents[2]
VIGNETTE = ROOT / "missions" / "vignette1.bpmn"

TWO_BRANCHES = """
<startEvent id="s"/> <parallelGateway id="fork"/> <exclusiveGateway id="meet"/> <endEvent id="e"/>
<userTask id="a">ask yes no</userTask> <userTask id="b">ask yes</userTask>
s -> fork -> a -> meet -> e
fork -> b -> meet
"""


@pytest.fixture(scope="module")
def vignette() -> PetriNet:
    return translate(read_mission(VIGNETTE))


def transition_lines(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("    :: ") and "d_step" in line]


def test_each_transition_is_a_line_that_names_its_element(vignette: PetriNet) -> None:
    model = text_of(vignette)
    lines = model.text.splitlines()
    assert sorted(model.transition_at.values()) == list(range(len(vignette.transitions)))
    for number, transition in model.transition_at.items():
        line = lines[number - 1]
        assert line.startswith("    :: ")
        assert f"/* {transition} " in line
        for step in vignette.transitions[transition].steps:
            assert f"{step.element} {step.action.value}" in line
    assert len(transition_lines(model.text)) == len(vignette.transitions)
    assert model.text.count("active proctype") == 1
    assert "end:" in lines


def test_what_comes_from_outside_is_tried_last(vignette: PetriNet) -> None:
    model = text_of(vignette)
    kinds = [
        vignette.transitions[transition].kind
        for _, transition in sorted(model.transition_at.items())
    ]
    assert kinds == sorted(kinds, key=list(Kind).index)
    assert model.text.count(":: else ->\n") == len(set(kinds))


def test_a_place_is_a_bit_until_it_needs_more_room() -> None:
    net = translate(notation(TWO_BRANCHES))
    meet = next(place for place in net.places if place.name == "meet")
    assert re.search(r"^bit at_meet;", text_of(net).text, re.M)
    wide = text_of(net, Encoding(net, {meet.index: 2}))
    assert re.search(r"^byte at_meet;", wide.text, re.M)
    assert "at_meet = at_meet + 1" in wide.text
    assert "at_meet = at_meet - 1" in wide.text


def test_only_what_is_asked_is_asserted(vignette: PetriNet) -> None:
    assert "assert" not in text_of(vignette, assertions=Assertions()).text
    assert (
        "assert(false) /* the run is stuck"
        in text_of(vignette, assertions=Assertions(stuck=True)).text
    )
    asserted = text_of(vignette, assertions=Assertions(transitions=frozenset({4})))
    [line] = [line for line in asserted.text.splitlines() if "assert" in line]
    assert "/* 4 " in line


def test_names_are_told_apart_and_are_no_words_of_promela_or_c() -> None:
    names = identifiers(
        "at_", ["a-b", "a_b", "a.b", "int", "do", "Überflug!", "x" * 200, "x" * 201]
    )
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"at_[A-Za-z0-9_]+", name) for name in names)
    assert names[:3] == ["at_a_b", "at_a_b_2", "at_a_b_3"]


def test_a_comment_cannot_be_ended_by_a_name() -> None:
    said = comment("a */ assert(false) /* \\\n b")
    assert said.count("*/") == said.count("/*") == 1
    assert "\n" not in said


@pytest.mark.tried_with(
    "Spin",
    "reads and checks the model of a mission",
    kind="Model checkers",
    result="no error",
    version="6.5.2",
)
def test_spin_takes_the_model_as_it_is_written(vignette: PetriNet, tmp_path: Path) -> None:
    spin = shutil.which("spin")
    assert spin, "apt-get install spin tcc"
    odd = replace(vignette, mission="*/ odd \\ name", elements={vignette.process: "# */ é"})
    (tmp_path / "m.pml").write_text(text_of(odd).text, encoding="utf-8")
    done = subprocess.run(
        [spin, "-a", "m.pml"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout == done.stderr == ""
    assert (tmp_path / "pan.c").exists()
