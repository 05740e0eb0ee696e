"""Missions that call into other files, as people run them: the search path, and a resume."""

from pathlib import Path

from tests.command_line import FLEET, CommandLine

HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" '
    'xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="urn:t">'
)
CALLS = """
<process id="MAIN" isExecutable="true">
  <startEvent id="S"/><sequenceFlow id="a" sourceRef="S" targetRef="Call"/>
  <callActivity id="Call" calledElement="SEARCH">
    <extensionElements><m2pem:out source="user.decision" target="found"/></extensionElements>
  </callActivity>
  <sequenceFlow id="b" sourceRef="Call" targetRef="E"/><endEvent id="E"/>
</process>
"""
CALLED = """
<process id="SEARCH">
  <startEvent id="S"/><sequenceFlow id="a" sourceRef="S" targetRef="Ask"/>
  <userTask id="Ask"><extensionElements><m2pem:prompt>Found it?</m2pem:prompt>
    <m2pem:decision value="{decision}"/></extensionElements></userTask>
  <sequenceFlow id="b" sourceRef="Ask" targetRef="Again"/>
  <callActivity id="Again" calledElement="CONFIRM"/>
  <sequenceFlow id="c" sourceRef="Again" targetRef="E"/><endEvent id="E"/>
</process>
"""
CONFIRM = '<globalUserTask id="CONFIRM" name="Sure?"/>'


def write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{HEAD}{text}</definitions>", encoding="utf-8")
    return path


def test_a_run_is_resumed_when_the_files_that_it_calls_are_gone_or_changed(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    mission = write(tmp_path / "mission.bpmn", CALLS)
    called = write(tmp_path / "lib" / "search.bpmn", CALLED.format(decision="yes"))
    confirm = write(tmp_path / "more" / "confirm.bpmn", CONFIRM)
    program = m2pem.start(
        *("run", mission, "--fleet", "sim", "--path", "lib", "--ocu", "plain"),
        *("--format", "json"),
        M2PEM_PATH=str(tmp_path / "more"),
    )
    program.until_record("PromptOpened", element="search:Ask")
    program.kill()
    mission.write_text("nonsense", encoding="utf-8")
    write(called, CALLED.format(decision="no"))
    confirm.unlink()

    resumed = m2pem.start("resume", "r1", "--ocu", "plain", "--format", "json")
    resumed.until_record("RunClaimed")
    resumed.type("yes")
    resumed.until_record("PromptOpened", element="confirm:CONFIRM")
    resumed.type("done")
    status, _ = resumed.rest()
    assert status == 0
    assert resumed.records[-1]["outcome"] == "completed"
    [found] = [each for each in resumed.records if each.get("key") == "found"]
    assert found["value"] == "yes"
    assert m2pem.run("replay", "r1", "--verify")[0] == 0


def test_check_and_simulate_look_where_the_path_says(m2pem: CommandLine, tmp_path: Path) -> None:
    mission = write(tmp_path / "mission.bpmn", CALLS)
    write(tmp_path / "lib" / "search.bpmn", CALLED.format(decision="yes"))
    write(tmp_path / "more" / "confirm.bpmn", CONFIRM)
    both = ("--path", "lib", "--path", "more")
    assert m2pem.run("check", mission)[0] == 1
    assert m2pem.run("check", mission, *both) == (0, f"{mission}: nothing found\n", "")
    assert m2pem.run("simulate", mission, *both)[0] == 0
    status, out, _ = m2pem.run("check", mission, "--path", "lib")
    assert status == 1
    assert out.startswith("lib/search.bpmn:7: search:Again: error: calledElement names 'CONFIRM'")
    status, _, errors = m2pem.run("check", mission, "--path", "nowhere")
    assert status == 2
    assert "nowhere" in errors


def test_a_served_mission_has_the_path_of_the_server(m2pem: CommandLine, tmp_path: Path) -> None:
    write(tmp_path / "lib" / "search.bpmn", CALLED.format(decision="yes"))
    write(tmp_path / "lib" / "confirm.bpmn", CONFIRM)
    mission = write(tmp_path / "elsewhere" / "mission.bpmn", CALLS)
    program = m2pem.start(
        *("serve", "--fleet", FLEET, "--simulate", "--path", "lib", "--ocu", "plain"),
        *("--format", "json"),
    )
    program.type(f"start {mission}")
    program.until_record("PromptOpened", element="search:Ask")
    program.kill()
