"""The whole of it on real pseudo-terminals: an executive, two terminals and a script."""

import itertools
import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[4]
RUN = (
    "run missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml --simulate --speed 20 "
    "--answers missions/answers/vignette1_detection_live.yaml"
)
SERVE = "serve --fleet fleet_configs/vignette1.yaml --simulate --speed 20"
PATIENCE_S = 40.0
NUMBERS = itertools.count(1)


class Pane:
    """A terminal of 80 by 24 in tmux, with a shell command in it."""

    def __init__(self, tmux: "Tmux", name: str, command: str) -> None:
        self._tmux = tmux
        self._name = name
        tmux.call("new-session", "-d", "-x", "80", "-y", "24", "-s", name, "sh")
        tmux.call("send-keys", "-t", name, "-l", command)
        self.press("Enter")

    def press(self, *keys: str) -> None:
        self._tmux.call("send-keys", "-t", self._name, *keys)

    @property
    def screen(self) -> str:
        return self._tmux.call("capture-pane", "-p", "-t", self._name)

    def until(self, condition: Callable[[str], bool], press: str = "") -> str:
        """Wait until something holds of the screen, pressing a key now and then."""
        end = time.monotonic() + PATIENCE_S
        while not condition(screen := self.screen):
            if time.monotonic() > end:
                pytest.fail(f"it never came on the screen:\n{screen}")
            if press:
                self.press(press)
            time.sleep(0.1)
        return screen

    def until_shown(self, *texts: str) -> str:
        return self.until(lambda screen: all(text in screen for text in texts))


class Tmux:
    """A tmux server of its own."""

    def __init__(self, folder: Path) -> None:
        self.environment = {
            **{key: value for key, value in os.environ.items() if not key.startswith("TMUX")},
            "HOME": str(folder),
            "XDG_STATE_HOME": str(folder / "state"),
            "M2PEM_OPERATOR": "script@here",
            "LC_ALL": "C.UTF-8",
            "TERM": "xterm-256color",
        }
        self._socket = f"m2pem-{os.getpid()}-{next(NUMBERS)}"

    def call(self, *words: str) -> str:
        done = subprocess.run(
            ["tmux", "-L", self._socket, "-f", os.devnull, *words],
            env=self.environment,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
        return done.stdout

    def m2pem(self, words: str) -> subprocess.CompletedProcess[str]:
        """Run a command as a script does, without a terminal."""
        return subprocess.run(
            [sys.executable, "-m", "m2pem", *shlex.split(words)],
            cwd=REPOSITORY,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )

    def terminal(self, operator: str, words: str) -> Pane:
        """Run a command on a terminal of its own."""
        python = f"{shlex.quote(sys.executable)} -m m2pem {words}"
        folder = shlex.quote(str(REPOSITORY))
        command = f"clear; cd {folder}; M2PEM_OPERATOR={operator} {python}; echo status $?"
        return Pane(self, operator.partition("@")[0], command)


@pytest.fixture
def tmux(tmp_path: Path) -> Iterator[Tmux]:
    if shutil.which("tmux") is None:
        pytest.fail("needs tmux: run `make setup`, or install it")
    server = Tmux(tmp_path)
    try:
        yield server
    finally:
        server.call("start-server", ";", "kill-server")


def test_two_terminals_and_a_script_steer_one_mission(tmux: Tmux) -> None:
    anna = tmux.terminal("anna@gcs1", RUN)
    anna.until_shown("RUNNING", "Question: USER SEND ROUTE", "● evsg1", "^X STOP")
    bob = tmux.terminal("bob@gcs2", "attach r1")
    bob.until_shown("RUNNING", "Question: USER SEND ROUTE", "● evsg1")

    bob.until(lambda screen: "DRIVE ROUTE" in screen, press="1")
    anna.until_shown("bob@gcs2 answered USER SEND ROUTE: Continue")
    late = tmux.m2pem("answer r1 p1 abort")
    assert (late.returncode, "p1 is not open" in late.stdout) == (1, True)

    bob.until_shown("Question: USER SEND ROUTE")
    answered = tmux.m2pem("answer r1 p2 abort")
    assert (answered.returncode, answered.stdout) == (0, "r1: p2 is answered: abort\n")
    bob.until_shown("script@here")
    anna.until_shown("r1 terminated", "status 0")
    bob.until_shown("TERMINATED", "The executive has ended.")
    bob.press("q")
    bob.until_shown("status 0")
    assert "there was nothing to stop" in tmux.m2pem("stop r1").stdout


def test_stop_from_another_terminal_ends_the_command_with_130(tmux: Tmux) -> None:
    anna = tmux.terminal("anna@gcs1", RUN)
    anna.until_shown("Question: USER SEND ROUTE")
    bob = tmux.terminal("bob@gcs2", "attach")
    bob.until_shown("Question: USER SEND ROUTE")
    bob.press("s")
    bob.until_shown("Send a signal")
    bob.press("C-x")
    bob.until_shown("STOP r1?")
    bob.press("C-x")
    anna.until_shown("r1 stopped: stopped by bob@gcs2", "status 130")


@pytest.mark.long
def test_scripts_pause_signal_and_stop(tmux: Tmux) -> None:
    anna = tmux.terminal("anna@gcs1", RUN)
    anna.until_shown("Question: USER SEND ROUTE")
    assert tmux.m2pem("pause r1").returncode == 0
    anna.until_shown("PAUSED", "by script@here")
    assert tmux.m2pem("continue r1 --by carol@gcs3").returncode == 0
    anna.until_shown("RUNNING", "r1 resumed by carol@gcs3")
    assert tmux.m2pem("signal r1 'Stop driving'").returncode == 0
    anna.until_shown("script@here: signal 'Stop driving'")
    assert tmux.m2pem("stop r1 --reason 'people on the road'").returncode == 0
    anna.until_shown("r1 stopped: people on the road", "status 130")


def test_without_a_terminal_it_is_plain_lines(tmux: Tmux) -> None:
    done = tmux.m2pem(
        "run missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml --simulate --speed 1000 "
        "--answers missions/answers/vignette1_abort.yaml --ocu terminal"
    )
    assert done.returncode == 0, done.stdout
    assert "no terminal here for --ocu terminal; using plain" in done.stdout
    assert "\x1b" not in done.stdout


def test_a_mission_is_started_from_the_list_and_goes_on_when_the_operator_quits(
    tmux: Tmux,
) -> None:
    anna = tmux.terminal("anna@gcs1", SERVE)
    anna.until_shown("no mission is running", "m Start")
    anna.press("m")
    anna.until_shown("Start a mission", "mehds_vignette_1.bpmn")
    before = [
        each.name
        for each in (REPOSITORY / "missions").glob("*.bpmn")
        if each.name < "vignette1.bpmn"
    ]
    anna.press(*["Down"] * len(before))
    anna.until_shown("vignette1.bpmn: nothing found")
    anna.press("Enter")
    anna.until_shown("Start vignette1.bpmn?", "y: yes")
    anna.press("y")
    anna.until_shown("RUNNING", "Question: USER SEND ROUTE")
    bob = tmux.terminal("bob@gcs2", "attach")
    bob.until_shown("Question: USER SEND ROUTE")
    bob.press("q")
    bob.until_shown("r1 is running. To stop it, press ^X twice.")
    bob.press("1")
    bob.until(lambda _: says(bob, "missions go on: r1. `m2pem attach` shows it"))
    anna.press("q")
    anna.until_shown("Quit, and let the mission go on")
    anna.press("1")
    anna.until(lambda _: says(anna, "serving goes on; missions go on: r1"))
    anna.until(lambda _: says(anna, "`m2pem stop r1` stops r1, Ctrl-C here stops everything"))
    assert tmux.m2pem("stop r1").returncode == 0
    anna.press("C-c")
    anna.until_shown("status 0")


def test_the_plain_unit_says_what_goes_on_when_the_operator_quits(tmux: Tmux) -> None:
    anna = tmux.terminal("anna@gcs1", f"{SERVE} --ocu plain")
    anna.until_shown("serving mehds-vignette-1")
    anna.press("quit", "Enter")
    anna.until(lambda _: says(anna, "serving goes on; no mission runs"))
    anna.press("C-c")
    anna.until_shown("status 0")


def says(pane: Pane, text: str) -> bool:
    """Whether a text is on the screen, which may have wrapped it."""
    return "".join(text.split()) in "".join(pane.screen.split())
