"""`m2pem take` and `m2pem give-back` of a vehicle that a mission commands."""

from tests.command_line import ANSWERS, FLEET, MISSION, CommandLine


def test_a_take_says_what_it_ends_and_the_mission_goes_on_as_was_said(m2pem: CommandLine) -> None:
    program = m2pem.start(
        "run", MISSION, "--fleet", FLEET, "--simulate", "--speed", "20", "--format", "json",
        "--answers", ANSWERS / "vignette1_detection.yaml",
    )  # fmt: skip
    program.until_record("BehaviorProgressed", state="RUNNING")
    status, said, errors = m2pem.run("take", "evsg1")
    assert (status, errors) == (1, "m2pem: evsg1 is not taken. --yes takes it all the same\n")
    assert said == (
        "r1: DRIVE ROUTE ends with error TAKEN_OVER. "
        "TAKEN_OVER is not handled: the mission will fail\n"
    )
    assert m2pem.run("take", "evsg1", "--yes", "--by", "anna@here")[0] == 0
    program.until_record("OperatorTookControl", resource="evsg1", by="anna@here")
    program.until_record("RunEnded", outcome="failed")


def test_what_nobody_commands_is_taken_and_given_back(m2pem: CommandLine) -> None:
    program = m2pem.start("serve", "--fleet", FLEET, "--ocu", "plain")
    assert "serving" in program.stderr.readline()
    assert m2pem.run("take", "evsg1", "--by", "anna@here")[0] == 0
    assert "evsg1      anna@here" in m2pem.run("fleet", "--running")[1]
    status, _, errors = m2pem.run("take", "evsg1", "--by", "ben@here")
    assert (status, errors) == (1, "m2pem: evsg1 is with anna@here\n")
    assert m2pem.run("give-back", "evsg1", "--by", "anna@here")[0] == 0
    assert "anna@here" not in m2pem.run("fleet", "--running")[1]


def test_a_request_for_control_outlives_the_executive(m2pem: CommandLine) -> None:
    program = m2pem.start(
        "run", MISSION, "--fleet", FLEET, "--simulate", "--format", "json", "--ocu", "none"
    )
    program.until_record("PromptOpened")
    assert m2pem.run("take", "evsg2", "--yes", "--by", "anna@here")[0] == 0
    assert m2pem.run("take", "evsg2", "--ask", "--by", "otto")[0] == 0
    assert m2pem.run("note", "r1", "wind picks up", "--by", "otto")[0] == 0
    program.until_record("OperatorNote", text="wind picks up", by="otto")
    program.kill()
    resumed = m2pem.start("resume", "r1", "--format", "json", "--ocu", "none")
    resumed.until_record("RunClaimed")
    said = m2pem.run("operators")[1]
    assert "otto asks anna@here for evsg2; anna@here is gone" in said
    assert m2pem.run("hand-over", "evsg2", "--by", "otto")[0] == 1
    assert m2pem.run("hand-over", "evsg2", "--by", "anna@here")[0] == 0
    resumed.until_record("ControlRequestEnded", requested_by="otto", outcome="given")
    resumed.until_record("OperatorTookControl", resource="evsg2", by="otto")
