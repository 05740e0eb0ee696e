"""Every key of the help does what it says."""

from m2pem_plugin_terminal.dialogs import KEYS, help_text
from rich.cells import cell_len
from terminal_world import Terminal, World, scout

DIALOGS = {
    "s": (["s"], "Send a signal"),
    "m": (["m"], "Start a mission"),
    "d": (["d"], "Command a vehicle or payload"),
    "t": (["t"], "Take, or give back"),
    "i": (["i"], "No error stops a task here"),
    "r": (["r"], "─ Runs ─"),
    "o": (["o"], "No operator is present"),
    "n": (["n"], "Note for the log of r1"),
    "c": (["c"], "Nothing is scheduled"),
    "f": (["f"], "Shared space and waiting tasks"),
    "v": (["v"], "r1 is monitored for no requirement"),
    "a": (["a"], "─ Alerts ─"),
    "?": (["question_mark"], "─ Keys ─"),
    "q": (["q"], "and let the mission go on"),
}
OTHER_TESTS = {
    "1 ... 9": "test_terminal_prompt_pane.py",
    "Tab": "test_terminal_prompt_pane.py",
    "p": "test_terminal_app.py",
    "^X ^X": "test_terminal_stop.py",
    "^A ^A": "test_terminal_stop.py",
    "^C ^C": "test_terminal_stop.py",
    "] [": "test_terminal_runs.py",
    "g": "test_terminal_map.py",
    "arrows": "test_terminal_map.py",
    "+ - 0": "test_terminal_map.py",
    ". ,": "test_terminal_map.py",
    "b": "test_terminal_alerts.py",
    "/": "test_terminal_app.py",
    "PgUp PgDn": "test_terminal_app.py",
    "Shift-Up": "test_terminal_app.py",
}


def test_every_key_of_the_help_is_tried() -> None:
    assert {key for key, _ in KEYS} == DIALOGS.keys() | OTHER_TESTS.keys()


def test_the_help_has_no_line_that_is_broken_at_80_columns() -> None:
    assert max(map(cell_len, help_text().plain.splitlines())) <= 60


async def test_keys_that_open_something_open_it(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        world.fake.say(scout(0.9))
        await terminal.until_shown("● DRIVE", "● scout")
        for keys, shown in DIALOGS.values():
            await opens(terminal, keys, shown)


async def opens(terminal: Terminal, keys: list[str], shown: str) -> None:
    await terminal.press(*keys)
    await terminal.until_shown(shown)
    await terminal.press("escape")
    await terminal.until(lambda: not terminal.app.in_dialog)
