"""docs/tutorials/ros2.md can be followed from its first command to its last."""

import shutil
from pathlib import Path

from tests.console import REPOSITORY, environment, follow

TUTORIALS = REPOSITORY / "docs" / "tutorials"


def test_the_tutorial_can_be_followed(tmp_path: Path, ros_domain: int) -> None:
    shell = environment(tmp_path / "home")
    patrol = tmp_path / "home" / "patrol"
    shutil.copytree(TUTORIALS / "patrol", patrol)
    fleet = patrol / "fleet_ros.yaml"
    fleet.write_text(fleet.read_text().replace("domain_id: 42", f"domain_id: {ros_domain}"))
    follow(TUTORIALS / "ros2.md", tmp_path, shell)
