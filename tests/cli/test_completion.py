import pytest

from tests.cli.conftest import Invoke
from tests.command_line import CommandLine


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
    assert complete(m2pem, "m2pem re").split() == ["plain,replay", "plain,resume"]
    assert "plain,--answers" in complete(m2pem, "m2pem run --a")


def test_an_unknown_shell_is_refused(invoke: Invoke) -> None:
    assert invoke("completion", "tcsh")[0] == 2
