import json
from pathlib import Path

from tests.cli.conftest import Invoke
from tests.command_line import FLEET


def test_templates_of_a_fleet_are_printed_or_written(invoke: Invoke, tmp_path: Path) -> None:
    command = ("templates", "export", "--fleet", FLEET, "--for", "camunda")
    status, out, err = invoke(*command)
    assert (status, err) == (0, "")
    names = [each["name"] for each in json.loads(out)]
    assert {"single_vehicle_routing", "formation", "ptz_scan_polygon", "Detector"} <= set(names)
    file = tmp_path / "m2pem.json"
    status, said, _ = invoke(*command, "--out", file)
    assert (status, said) == (
        0,
        f"{file}: {len(names)} element templates of the fleet mehds-vignette-1\n",
    )
    assert file.read_text(encoding="utf-8") == out


def test_what_cannot_be_used_is_refused(invoke: Invoke, tmp_path: Path) -> None:
    command = ("templates", "export", "--fleet", FLEET)
    assert invoke(*command)[0] == 2
    assert invoke(*command, "--for", "word")[0] == 2
    assert "name a fleet file" in invoke(*command[:3], "sim", "--for", "camunda")[2]
    status, _, err = invoke(*command, "--for", "camunda", "--out", tmp_path / "no" / "m2pem.json")
    assert (status, "cannot be written" in err) == (2, True)
