from pathlib import Path

import click
import pytest

from m2pem.cli.setting import refuse_speed
from m2pem.fleet.fleet_file import load_fleet

FLEET = """
version: 1
name: mixed
vehicles:
  uav1: {{domain: air, arbiter: mavlink, {uav1}payloads: {{cam: {{arbiter: ptz}}}}}}
  ugv1: {{domain: ground, arbiter: sim}}
"""


def test_what_is_neither_simulated_nor_software_in_the_loop_keeps_real_time(tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET.format(uav1=""), encoding="utf-8")
    with pytest.raises(click.UsageError, match=r"--speed 10: uav1, uav1/cam of .* `sitl: true`"):
        refuse_speed(load_fleet(file), 10.0, simulated=False)
    refuse_speed(load_fleet(file), 1.0, simulated=False)
    refuse_speed(load_fleet(file), 10.0, simulated=True)


def test_software_in_the_loop_runs_as_fast_as_it_is_told_with_its_payloads(tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET.format(uav1="sitl: true, "), encoding="utf-8")
    refuse_speed(load_fleet(file), 10.0, simulated=False)
