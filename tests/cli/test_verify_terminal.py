"""`m2pem verify` on a mission that takes long, with a person at a terminal who looks on."""

import json
import re
import signal
from itertools import pairwise
from pathlib import Path

import pytest

from tests.command_line import CommandLine
from tests.terminal import CTRL_C, Terminal
from tests.verify.models import unsafe

ENGINES = ["builtin", "spin"]

BRANCHES = 14
"""So many that no engine here is through with them before a test has ended."""


def tangled(handled: bool = True) -> str:
    """Branches that each ask, and go on by an answer that the others overwrite.

    What one does may change what another does: no order of theirs can be left out. If not
    `handled`, the first has no flow for one of its answers.
    """
    body = []
    for n in range(BRANCHES):
        way = "" if n == 0 and not handled else f' default="on{n}"'
        body.append(
            f'<userTask id="Ask{n}"><extensionElements><m2pem:prompt>Go?</m2pem:prompt>'
            '<m2pem:decision value="go"/><m2pem:decision value="wait"/></extensionElements>'
            f'</userTask><userTask id="Then{n}"><extensionElements>'
            '<m2pem:prompt>Then?</m2pem:prompt><m2pem:decision value="go"/></extensionElements>'
            f'</userTask><exclusiveGateway id="Way{n}"{way}/><exclusiveGateway id="Again{n}"/>'
            f'<sequenceFlow id="in{n}" sourceRef="Fork" targetRef="Again{n}"/>'
            f'<sequenceFlow id="ask{n}" sourceRef="Again{n}" targetRef="Ask{n}"/>'
            f'<sequenceFlow id="then{n}" sourceRef="Ask{n}" targetRef="Then{n}"/>'
            f'<sequenceFlow id="way{n}" sourceRef="Then{n}" targetRef="Way{n}"/>'
            f'<sequenceFlow id="back{n}" sourceRef="Way{n}" targetRef="Again{n}">'
            "<conditionExpression>user.decision == 'wait'</conditionExpression></sequenceFlow>"
            f'<sequenceFlow id="on{n}" sourceRef="Way{n}" targetRef="Join">'
            + ("" if way else "<conditionExpression>user.decision == 'on'</conditionExpression>")
            + "</sequenceFlow>"
        )
    return f"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
      xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="tangled"><process id="Tangled">
      <startEvent id="Start"/><parallelGateway id="Fork"/><parallelGateway id="Join"/>
      <endEvent id="End"/><sequenceFlow id="begin" sourceRef="Start" targetRef="Fork"/>
      {"".join(body)}<sequenceFlow id="over" sourceRef="Join" targetRef="End"/></process>
      </definitions>"""


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    path = tmp_path / "tangled.bpmn"
    path.write_text(tangled(), encoding="utf-8")
    return path


@pytest.fixture
def unhandled(tmp_path: Path) -> Path:
    path = tmp_path / "unhandled.bpmn"
    path.write_text(tangled(handled=False), encoding="utf-8")
    return path


def running_in(folder: Path) -> list[str]:
    """Programs that work in the folder, or in one below it."""
    found = []
    for each in Path("/proc").glob("[0-9]*"):
        try:
            if (each / "cwd").readlink().is_relative_to(folder / "below"):
                found.append(each.name)
        except OSError:  # ended meanwhile, or somebody else's
            continue
    return found


def at_terminal(tmp_path: Path, *words: str | Path) -> Terminal:
    """Results go to a file, all else to the terminal; Spin works in the folder `below`."""
    (tmp_path / "below").mkdir()
    return Terminal(
        tmp_path, "verify", *words, results=tmp_path / "results", TMPDIR=str(tmp_path / "below")
    )


def number(counted: str) -> int:
    return int(counted.replace(",", ""))


def results(tmp_path: Path) -> str:
    return (tmp_path / "results").read_text(encoding="utf-8")


def test_a_long_search_counts_up_on_a_terminal_and_wipes_its_line(
    tmp_path: Path, mission: Path
) -> None:
    with at_terminal(tmp_path, mission, "--max-seconds", "8") as terminal:
        first = terminal.until(r"searching for \d+ s, ([\d,]+) states found, [\d,]+ of them to be")
        terminal.until(r"searching for [2-9] s, ")
        assert terminal.rest() == 3
    counted = re.findall(r" s, ([\d,]+) states found", terminal.shown)
    assert counted[0] == first[1]
    steps = [after > before for before, after in pairwise(map(number, counted))]
    assert any(steps)
    assert steps.count(False) <= 1, "the second search, that leaves orders out, counts anew"
    assert len(counted) < 80, "it is shown as often as a person can read, not for each state"
    assert terminal.shown.endswith("\r\x1b[K")
    assert "searching for" not in results(tmp_path)
    assert "then the limit of time ended the search" in results(tmp_path)


@pytest.mark.parametrize("engine", ENGINES)
def test_without_a_terminal_nothing_is_shown_on_the_way(
    m2pem: CommandLine, mission: Path, engine: str
) -> None:
    status, out, err = m2pem.run("verify", mission, "--max-seconds", "1", "--engine", engine)
    assert (status, err) == (3, "")
    assert re.search(
        r"undecided  no-deadlock .* \([\d,]+ states, stopped by the limit of time\)", out
    )
    assert re.search(r"undecided; [\d,]+ states and [\d,]+ steps were searched in \d+ ms", out)


def test_a_limit_of_states_says_how_many_were_seen(m2pem: CommandLine, mission: Path) -> None:
    status, out, _ = m2pem.run("verify", mission, "--max-states", "5000")
    assert status == 3
    seen = re.search(
        r"undecided; ([\d,]+) states .*; then the limit of states ended the search", out
    )
    assert seen is not None
    assert 5_000 <= int(seen[1].replace(",", "")) < 6_000
    assert re.search(r"holds +can-be-triggered", out), "that takes no search"


def test_ctrl_c_leaves_undecided_what_was_not_seen(tmp_path: Path, mission: Path) -> None:
    with at_terminal(tmp_path, mission, "--report", "found.json") as terminal:
        terminal.until(r"\d,\d{3} states found")
        terminal.press(CTRL_C)
        assert terminal.rest() == 3
    text = results(tmp_path)
    assert "then an interruption by hand ended the search" in text
    assert not re.search(r"^(holds|violated) +no-deadlock", text, re.M)
    assert "Traceback" not in terminal.shown + text
    report = json.loads((tmp_path / "found.json").read_bytes())
    assert report["verdict"] == "undecided"
    assert report["coverage"]["stopped"] == "an interruption by hand"
    assert report["coverage"]["states"] > 1_000


def test_ctrl_c_keeps_the_violations_that_were_found_until_then(
    tmp_path: Path, unhandled: Path
) -> None:
    with at_terminal(tmp_path, unhandled, "--exhaustive") as terminal:
        terminal.until("states found")
        terminal.press(CTRL_C)
        assert terminal.rest() == 1
    text = results(tmp_path)
    assert re.search(r"^violated +decisions-handled", text, re.M)
    assert re.search(r"^undecided +no-deadlock", text, re.M)
    assert "no flow of Way0 is true and it has no default" in text
    assert "Then0: the operator answers 'go'" in text
    assert "violated; " in text.splitlines()[-1]
    assert "then an interruption by hand ended the search" in text.splitlines()[-1]


def test_ctrl_c_ends_the_search_of_requirements_before_it_begins(
    tmp_path: Path, mission: Path
) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text('requirements: [{id: asked, ltl: "<> completed(Ask0)"}]', encoding="utf-8")
    with at_terminal(tmp_path, mission, "--spec", spec) as terminal:
        terminal.until("states found")
        terminal.press(CTRL_C)
        assert terminal.rest() == 3
    assert re.search(r"^undecided  asked .* \(not begun, after an int", results(tmp_path), re.M)


@pytest.mark.parametrize("how", ["Ctrl-C", pytest.param("SIGTERM", marks=pytest.mark.long)])
def test_what_ends_m2pem_ends_spin_and_what_it_saw_is_told(
    tmp_path: Path, mission: Path, how: str
) -> None:
    with at_terminal(tmp_path, mission, "--engine", "spin") as terminal:
        terminal.until("searching for [3-9] s")
        assert running_in(tmp_path), "Spin's checker works in a folder of its own"
        if how == "Ctrl-C":
            terminal.press(CTRL_C)
        else:
            terminal.process.terminate()
        assert terminal.rest() == 3
    assert running_in(tmp_path) == []
    assert [*(tmp_path / "below").iterdir()] == []
    text = results(tmp_path)
    seen = re.search(r"undecided; ([\d,]+) states .* by Spin; then an interruption by hand", text)
    assert seen is not None
    assert int(seen[1].replace(",", "")) > 1_000
    assert re.search(r"^undecided  can-complete .*not begun, after an interruption", text, re.M)
    assert "the built-in search was not begun" in text
    assert "Traceback" not in terminal.shown + text


def test_a_violation_is_printed_while_the_search_goes_on(
    m2pem: CommandLine, unhandled: Path
) -> None:
    program = m2pem.start("verify", unhandled, "--exhaustive")
    program.until(lambda line: line.startswith("violated   decisions-handled"))
    program.send(signal.SIGINT)
    assert program.rest() == (1, "")
    said = [line for line in program.lines if line.startswith("violated   decisions-handled")]
    assert len(said) == 1
    text = "\n".join(program.lines)
    assert "no flow of Way0 is true and it has no default" in text
    assert "then an interruption by hand ended the search" in text


def test_after_a_violation_a_large_search_ends(m2pem: CommandLine, tmp_path: Path) -> None:
    mission = tmp_path / "unsafe.bpmn"
    mission.write_bytes(unsafe(12).source)
    status, out, _ = m2pem.run("verify", mission)
    assert status == 1
    assert re.search(r"undecided  no-livelock .*stopped by a violation that was found before", out)
    assert "then a violation that was found before ended the search" in out
