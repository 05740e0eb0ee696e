"""`make test-ros` runs these tests. They keep DDS on 127.0.0.1, in ROS domains of their own."""

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from m2pem_plugin_ros.loopback import keep_on_loopback
from m2pem_plugin_ros.testing import ros_domain
from ros_e2e_programs import Programs, programs

if TYPE_CHECKING:
    from ros_e2e_watch import Watch

__all__ = ["ros_domain"]

collect_ignore_glob = [] if find_spec("rclpy") else ["test_*.py"]

keep_on_loopback()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a contract that says which of its tests are `quick`, the others are long."""
    for item in items:
        if isinstance(item, pytest.Function) and item.name not in getattr(
            item.cls, "quick", (item.name,)
        ):
            item.add_marker(pytest.mark.long)


@pytest.fixture
def m2pem(tmp_path: Path, ros_domain: int) -> Iterator[Programs]:
    """Programs of m2pem, in the folder of the test."""
    with programs(tmp_path, ros_domain) as started:
        yield started


@pytest.fixture
def watch(request: pytest.FixtureRequest, ros_domain: int) -> Iterator["Watch"]:
    """What the vehicles do that the module of the test names in `WATCHED`."""
    from ros_e2e_watch import watching  # it needs ROS

    with watching(request.module.WATCHED, ros_domain) as heard:
        yield heard
