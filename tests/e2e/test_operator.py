"""An operator at the plain unit, over a pipe and at a terminal."""

import re
import signal
import sys
from collections import Counter
from pathlib import Path

import pexpect

from m2pem.simulation.state_file import recorded_effects
from tests.command_line import ANSWERS, FLEET, MISSION, CommandLine, Program, fleet_with_state

STOP_DRIVING = "dc45ff2b-ef6b-45bd-96e6-c7ac8ef055c2"


def driving(m2pem: CommandLine, fleet: Path = FLEET, speed: str = "20") -> Program:
    """The mission, with evsg1 on its route and nobody detecting anything."""
    program = m2pem.start(
        "run", MISSION, "--fleet", fleet, "--simulate", "--speed", speed, "--format", "json",
        "--answers", ANSWERS / "vignette1_route_live.yaml",
    )  # fmt: skip
    program.until_record("PromptOpened", element="UserSendRoute")
    program.type("1")
    program.until_record("BehaviorProgressed", state="RUNNING")
    return program


def effects(state: Path) -> Counter[tuple[str, str]]:
    return Counter((each.kind.value, each.resource) for each in recorded_effects(state))


def test_pause_resume_and_stop_reach_the_vehicle_once_each(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet)
    program.type("pause")
    paused = program.until_record("RunPaused", by="plain")
    program.type("resume")
    resumed = program.until_record("RunResumed", by="plain")
    assert resumed["at_us"] > paused["at_us"]
    assert resumed["t"] == paused["t"]  # mission time stands during a pause
    program.type("stop")
    program.until_record("RunEnded", outcome="stopped")
    ended = program.until_record("BehaviorEnded", state="CANCELLED")
    assert ended["element"] == "DriveRoute"
    assert program.rest()[0] == 130
    once = ["start", "hold", "resume", "cancel", "end"]
    assert effects(state) == Counter((kind, "evsg1") for kind in once)


def test_a_signal_is_sent_by_its_name_as_by_its_id(m2pem: CommandLine) -> None:
    program = driving(m2pem)
    program.type("signal Stop driving")
    assert program.until_record("SignalThrown")["signal"] == STOP_DRIVING
    program.until_record("BehaviorEnded", element="DriveStop", state="SUCCEEDED")
    program.type("stop")
    assert program.rest()[0] == 130


def test_what_cannot_be_done_is_said_and_changes_nothing(m2pem: CommandLine) -> None:
    program = m2pem.start("run", MISSION, "--fleet", FLEET, "--format", "json")
    program.until_record("PromptOpened", element="UserSendRoute")
    for line in ("3", "signal no such", "resume", "stop r9", "start", "p1 continue", "2"):
        program.type(line)
    program.until_record("BehaviorProgressed", state="RUNNING")
    program.type("stop")
    status, errors = program.rest()
    assert status == 130
    assert "no run has a signal 'no such'; known: Stop driving" in errors
    assert "r1: it is not paused" in errors
    assert "'2' is no command, and no prompt is open" in errors
    assert "say which: start FILE" in errors
    assert "r9 is not driven by this executive" in errors
    assert "'3' does not answer p1; its decisions: 1 continue, 2 abort" in errors


def test_the_run_goes_on_when_the_input_ends(m2pem: CommandLine) -> None:
    program = driving(m2pem, speed="200")
    program.end_input()
    program.until_record("RunEnded", outcome="terminated")
    assert program.rest()[0] == 0


def test_an_operator_who_quits_leaves_the_run_alone(m2pem: CommandLine) -> None:
    program = driving(m2pem, speed="200")
    program.type("quit")
    program.type("stop")
    program.until_record("RunEnded", outcome="terminated")
    assert program.rest()[0] == 0


def test_the_end_of_the_input_is_noted_when_a_prompt_is_open(m2pem: CommandLine) -> None:
    program = m2pem.start("run", MISSION, "--fleet", "sim")
    program.until_text("[p1] UserSendRoute")
    program.end_input()
    program.until_text("the input has ended: no operator answers here any more")
    program.send(signal.SIGTERM)
    assert program.rest()[0] == 130


def test_an_operator_at_a_terminal(m2pem: CommandLine) -> None:
    terminal = pexpect.spawn(
        sys.executable,
        ["-m", "m2pem", "run", str(MISSION), "--fleet", str(FLEET), "--simulate", "--speed", "50",
         "--answers", str(ANSWERS / "vignette1_detection_live.yaml"), "--ocu", "plain"],
        cwd=str(m2pem.folder), env={**m2pem.environment, "TERM": "xterm"},
        encoding="utf-8", timeout=60,
    )  # fmt: skip
    terminal.expect(re.escape("[p1] UserSendRoute: Send the route, then continue"))
    terminal.sendline("Continue")
    terminal.expect("DRIVE ROUTE: evsg1 begins single_vehicle_routing")
    terminal.expect("REVERSE: evsg1 ends reverse: succeeded")
    terminal.expect(re.escape("[p2]"))
    terminal.sendline("2")
    terminal.expect("\x1b\\[32m.*r1 terminated")
    terminal.expect(pexpect.EOF)
    terminal.close()
    assert terminal.exitstatus == 0


def test_a_terminal_without_colour(m2pem: CommandLine) -> None:
    terminal = pexpect.spawn(
        sys.executable,
        ["-m", "m2pem", "run", str(MISSION), "--fleet", "sim", "--ocu", "plain"],
        cwd=str(m2pem.folder), env={**m2pem.environment, "NO_COLOR": "1"},
        encoding="utf-8", timeout=60,
    )  # fmt: skip
    terminal.expect(re.escape("[p1]"))
    terminal.sendline("abort")
    terminal.expect(pexpect.EOF)
    terminal.close()
    assert terminal.exitstatus == 0
    assert "\x1b" not in terminal.before


def test_ctrl_c_at_a_terminal_stops_the_mission(m2pem: CommandLine) -> None:
    terminal = pexpect.spawn(
        sys.executable,
        ["-m", "m2pem", "run", str(MISSION), "--fleet", "sim", "--ocu", "plain"],
        cwd=str(m2pem.folder), env=m2pem.environment, encoding="utf-8", timeout=60,
    )  # fmt: skip
    terminal.expect(re.escape("[p1]"))
    terminal.sendintr()
    terminal.expect("r1 stopped: stopped by SIGINT")
    terminal.expect(pexpect.EOF)
    terminal.close()
    assert terminal.exitstatus == 130


def test_in_the_background_of_a_shell_it_goes_on_and_listens_when_it_is_back(
    m2pem: CommandLine,
) -> None:
    shell = pexpect.spawn(
        "bash", ["--norc", "-i"], cwd=str(m2pem.folder),
        env={**m2pem.environment, "PS1": "$ "}, encoding="utf-8", timeout=60,
    )  # fmt: skip
    shell.sendline(f"{sys.executable} -m m2pem run {MISSION} --fleet sim --ocu plain &")
    shell.expect(re.escape("[p1]"))
    shell.sendline("jobs")
    shell.expect("Running")
    shell.sendline("fg")
    shell.sendline("abort")
    shell.expect("r1 terminated")
    shell.expect(re.escape("$ "))
    shell.sendline("exit")
    shell.expect(pexpect.EOF)
    shell.close()


def test_a_run_killed_during_a_pause_is_paused_when_it_is_resumed(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet)
    program.type("pause")
    program.until_record("RunPaused")
    program.kill()
    resumed = m2pem.start("resume", "r1")
    resumed.until_text("r1 taken up again")
    resumed.type("resume")
    resumed.until_text("r1 resumed by plain")
    resumed.type("stop")
    status, errors = resumed.rest()
    assert status == 130
    assert "r1 is paused" in errors
    once = ["start", "hold", "resume", "cancel", "end"]
    assert effects(state) == Counter((kind, "evsg1") for kind in once)


def test_a_vehicle_that_was_lost_in_a_crash_is_held_and_asked_about(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet)
    program.kill()
    for file in tmp_path.glob(f"{state.name}*"):
        file.unlink()
    resumed = m2pem.start("resume", "r1")
    resumed.until_text("evsg1: single_vehicle_routing: held")
    resumed.until_text("[p2] DriveRoute")
    resumed.type("resume")
    resumed.until_text("evsg1: single_vehicle_routing: started again by plain")
    resumed.type("stop")
    resumed.until_text("r1 stopped: stopped by plain")
    assert resumed.rest()[0] == 130
    kinds = [each.kind.value for each in recorded_effects(state) if each.resource == "evsg1"]
    assert kinds.count("start") == 1
