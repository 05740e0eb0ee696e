"""What docs/ros-simulation.md says of simulated vehicles is so."""

import re
import shlex
from pathlib import Path

import pytest
from m2pem_plugin_ros import settings
from m2pem_plugin_ros.simulator.faults import GRAMMAR, KINDS
from m2pem_plugin_ros.simulator.specification import DETECTOR_SETTINGS, SETTINGS
from m2pem_plugin_ros.testing import Peer
from ros_sim_watch import COMMAND

PAGE = Path(__file__).parents[4] / "docs" / "ros-simulation.md"
TEXT = PAGE.read_text(encoding="utf-8")
FLEET = re.search(r"```yaml\n(.*?)```", TEXT, re.S)
COMMANDS = re.findall(r"^\$ m2pem (sim ros .*)$", TEXT.replace("\\\n", " "), re.M)


def test_all_faults_are_told_and_can_be_written_so() -> None:
    table = TEXT.partition("| action | what happens |")[2]
    rows = [row.split("|")[1] for row in table.splitlines() if row.startswith("| `")]
    told = [word for row in rows for word in re.findall(r"`([^`]+)`", row)]
    assert {GRAMMAR.parse(word).kind.pattern for word in told} == {
        kind.pattern for kind in KINDS.values()
    }


def test_all_words_are_told() -> None:
    told = set(re.findall(r"`([a-z_]+)`", TEXT))
    assert set(SETTINGS) | set(DETECTOR_SETTINGS) <= told


@pytest.mark.parametrize("command", COMMANDS)
def test_its_commands_simulate_vehicles(command: str, tmp_path: Path, ros_domain: int) -> None:
    words = shlex.split(command)
    if "--fleet" in words and not hasattr(settings, "DetectorMessage"):
        pytest.skip("the settings of ROS vehicles cannot be read")
    assert FLEET is not None
    (tmp_path / "fleet.yaml").write_text(FLEET[1], encoding="utf-8")
    words = [str(tmp_path / word) if word == "fleet.yaml" else word for word in words]
    if "--domain-id" in words:
        words[words.index("--domain-id") + 1] = str(ros_domain)
    with Peer(COMMAND, ros_domain, words) as peer:
        assert peer.process.poll() is None
    assert peer.process.returncode == 0


def test_there_are_commands() -> None:
    assert len(COMMANDS) == 2
