import json
from pathlib import Path

from tests.cli.conftest import Invoke
from tests.command_line import CommandLine, install_plugin

PICKY = """
class Picky:
    def __init__(self, connections, context):
        raise ValueError("no port is named")

@hookimpl
def m2pem_register_arbiters(register):
    register("picky", Picky)
"""


def test_built_ins_are_listed_with_their_behaviors(invoke: Invoke) -> None:
    status, out, err = invoke("plugins")
    assert (status, err) == (0, "")
    assert "    arbiter sim\n        ground vehicle: area_observe" in out
    assert "    service Detector\n" in out
    assert "    ocu plain\n" in out


def test_plugins_as_json(invoke: Invoke) -> None:
    listed = json.loads(invoke("plugins", "--format", "json")[1])
    provided = [what for plugin in listed["plugins"] for what in plugin["provides"]]
    assert {"arbiter sim", "service Detector", "ocu plain"} <= set(provided)
    assert "takeoff" in listed["behaviors"]["sim"]["air vehicle"]
    assert "takeoff" not in listed["behaviors"]["sim"]["ground vehicle"]


def test_a_broken_plugin_is_shown_with_what_broke(m2pem: CommandLine, tmp_path: Path) -> None:
    status, out, _ = m2pem.run("plugins", **install_plugin(tmp_path, "boat", "import no_such"))
    assert status == 0
    assert "boat  (m2pem-plugin-boat 1.0)\n" in out
    assert "    broken: ModuleNotFoundError: No module named 'no_such'\n" in out


def test_an_arbiter_that_needs_a_real_fleet_is_listed_without_behaviors(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    status, out, err = m2pem.run("plugins", **install_plugin(tmp_path, "picky", PICKY))
    assert (status, err) == (0, "")
    _, _, after = out.partition("    arbiter picky\n")
    assert after != out
    assert not after.startswith("        ")
