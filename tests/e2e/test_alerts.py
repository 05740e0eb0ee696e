"""Alerts at the command line: who acknowledged them, and who takes care, outlives the executive."""

import json

from tests.command_line import FLEET, MISSION, CommandLine


def test_an_acknowledgement_outlives_kill_9(m2pem: CommandLine) -> None:
    program = m2pem.start("run", MISSION, "--fleet", FLEET, "--format", "json")
    asked = program.until_record("PromptOpened", element="UserSendRoute")
    listed = ""
    while "a1: warning: r1: asks:" not in listed:
        status, listed, _ = m2pem.run("alerts")
        assert status == 0
    assert m2pem.run("acknowledge", "a1", "--by", "anna")[0] == 0
    status, _, errors = m2pem.run("acknowledge", "a1", "--by", "otto")
    assert status == 1
    assert "anna has acknowledged a1 already" in errors
    assert m2pem.run("own", "a1", "--owner", "otto")[0] == 0
    status, _, errors = m2pem.run("own", "a9")
    assert status == 1
    assert "'a9' is no open alert; open: a1" in errors
    assert "nothing to acknowledge" in m2pem.run("acknowledge", "--all")[2]
    program.kill()
    resumed = m2pem.start("resume", "r1", "--format", "json")
    resumed.until_record("RunClaimed")
    (alert,) = json.loads(m2pem.run("alerts", "--format", "json")[1])["alerts"]
    assert (alert["subject"], alert["acknowledged_by"]) == (asked["prompt"], "anna")
    assert alert["owner"] == "otto"
    assert m2pem.run("answer", "r1", asked["prompt"], "continue")[0] == 0
    over: list[dict[str, str]] = []
    while not over or over[0]["cleared_us"] is None:
        over = json.loads(m2pem.run("alerts", "--over", "--format", "json")[1])["alerts"]
        over = [each for each in over if each["alert"] == "a1"]
    assert m2pem.run("stop", "r1")[0] == 0
    assert resumed.rest()[0] == 130
