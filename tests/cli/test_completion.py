from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION, CommandLine, install_plugin


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_what_a_shell_is_to_source(invoke: Invoke, shell: str) -> None:
    status, out, _ = invoke("completion", shell)
    assert status == 0
    assert f"_M2PEM_COMPLETE={shell}_complete" in out


def complete(m2pem: CommandLine, words: str) -> str:
    return m2pem.run(
        _M2PEM_COMPLETE="bash_complete", COMP_WORDS=words, COMP_CWORD=str(words.count(" "))
    )[1]


def test_commands_and_options_are_completed(m2pem: CommandLine) -> None:
    found = complete(m2pem, "m2pem re").split()
    assert found == ["plain,replay", "plain,resume", "plain,resolve", "plain,revise"]
    assert "plain,--answers" in complete(m2pem, "m2pem run --a")


def values(m2pem: CommandLine, words: str) -> list[str]:
    return [line.partition(",")[2] for line in complete(m2pem, words).split()]


def test_runs_are_completed(m2pem: CommandLine) -> None:
    abort = ("--answers", ANSWERS / "vignette1_abort.yaml", "--ocu", "none")
    assert m2pem.run("run", MISSION, "--fleet", FLEET, *abort)[0] == 0
    assert values(m2pem, "m2pem replay ") == ["r1"]
    assert values(m2pem, "m2pem replay r2") == []
    assert values(m2pem, "m2pem runs --delete ") == ["r1"]
    assert values(m2pem, "m2pem resume ") == []  # it has ended
    assert values(m2pem, "m2pem replay --journal missing.db ") == []
    program = m2pem.start("run", MISSION, "--fleet", FLEET, "--ocu", "plain")
    program.until_text("UserSendRoute")
    assert values(m2pem, "m2pem replay ") == ["r2", "r1"]
    for command in ("answer", "signal", "pause", "continue", "stop", "attach", "resume"):
        assert values(m2pem, f"m2pem {command} ") == ["r2"]


def test_a_file_that_is_no_journal_has_no_runs(m2pem: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "text.db").write_text("no journal")
    assert complete(m2pem, "m2pem replay --journal text.db ").split() == []


def test_processes_of_the_mission_are_completed(m2pem: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "m.bpmn").write_text(
        """<bpmn:definitions><bpmn:process name="a" id="SURVEY" isExecutable="true"/>
        <bpmn:processRef id="NONE"/><process isExecutable="true"
        id='PATROL'/></bpmn:definitions>"""
    )
    for command in ("run", "check", "verify", "simulate", "start"):
        assert values(m2pem, f"m2pem {command} m.bpmn --process ") == ["SURVEY", "PATROL"]
    assert values(m2pem, "m2pem run m.bpmn --process P") == ["PATROL"]
    assert values(m2pem, "m2pem run missing.bpmn --process ") == []
    assert values(m2pem, "m2pem run --process ") == []


def test_operator_units_are_completed_one_after_the_other(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    code = """
@hookimpl
def m2pem_register_ocus(register):
    register("bridge", dict)
"""
    m2pem.environment |= install_plugin(tmp_path, "boat", code)
    assert {"bridge", "none", "plain"} <= set(values(m2pem, "m2pem run --ocu "))
    assert values(m2pem, "m2pem run --ocu pl") == ["plain"]
    assert "plain,bridge" in values(m2pem, "m2pem attach --ocu plain,")
    assert not {"plain,plain", "plain,none"} & set(values(m2pem, "m2pem attach --ocu plain,"))


def test_missions_and_fleets_are_files(m2pem: CommandLine) -> None:
    assert complete(m2pem, "m2pem run mis") == "file,mis\n"
    assert complete(m2pem, "m2pem run --fleet si").split() == ["plain,sim", "file,si"]


@pytest.mark.parametrize("words", ["replay ", "stop ", "run m.bpmn --process ", "runs --delete "])
def test_completion_imports_nothing_slow(m2pem: CommandLine, words: str) -> None:
    imported = m2pem.run(
        PYTHONPROFILEIMPORTTIME="1",
        _M2PEM_COMPLETE="bash_complete",
        COMP_WORDS=f"m2pem {words}",
        COMP_CWORD=str(1 + words.count(" ")),
    )[2]
    assert "m2pem.cli.completers" in imported
    slow = ("lxml", "pydantic", "ruamel", "rustworkx", "numpy", "shapely", "fastapi")
    assert [name for name in slow if f" {name}\n" in imported] == []


def test_an_unknown_shell_is_refused(invoke: Invoke) -> None:
    assert invoke("completion", "tcsh")[0] == 2
