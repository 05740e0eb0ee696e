"""`m2pem init --for ros`: the folder runs on the simulated vehicle that its README starts."""

import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from m2pem_plugin_ros.testing import reserved_domain
from ros_e2e_programs import Programs, programs


@pytest.fixture
def there(tmp_path: Path) -> Iterator[Programs]:
    with reserved_domain() as domain, programs(tmp_path, domain) as started:
        yield started


@pytest.mark.long
@pytest.mark.timeout(200)
def test_the_folder_runs_on_the_vehicle_of_its_readme(there: Programs) -> None:
    assert there.m2pem("init", "made", "--for", "ros").rest() == 0
    there.folder /= "made"
    readme = (there.folder / "README.md").read_text(encoding="utf-8")
    lines = [line for line in readme.splitlines() if line.startswith("m2pem ")]
    typed = [shlex.split(line, comments=True) for line in lines]
    (simulate,) = [words for words in typed if words[:3] == ["m2pem", "sim", "ros"]]
    run = next(words for words in typed if words[:2] == ["m2pem", "run"])
    there.m2pem(*simulate[1:]).until_line("ready")
    mission = there.m2pem(*run[1:], "--journal", "memory:", "--ocu", "none", "--format", "json")
    assert mission.rest() == 0, mission.said
    done = [each["state"] for each in mission.those("BehaviorEnded")]
    assert done == ["SUCCEEDED", "SUCCEEDED"]
    assert [each["name"] for each in mission.those("BehaviorRequested")] == [
        "single_vehicle_routing",
        "goto",
    ]
