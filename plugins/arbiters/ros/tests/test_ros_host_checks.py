"""`m2pem doctor` for ROS: one installation, interfaces, and the domain."""

import importlib.metadata
from pathlib import Path

import pytest
from m2pem_plugin_ros import host_checks
from m2pem_plugin_ros.host_checks import check_host
from m2pem_plugin_ros.installation import RosError

from m2pem.api import HealthStatus
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.fleet_file import load_fleet

CONFIGS = Path(__file__).parents[4] / "fleet_configs"


@pytest.fixture
def ros_fleet() -> Fleet:
    return load_fleet(str(CONFIGS / "vignette1_ros.yaml"))


def test_a_fleet_without_ros_asks_for_nothing() -> None:
    assert check_host(load_fleet(str(CONFIGS / "vignette1.yaml"))) == ()


def test_ros_and_the_interfaces_of_the_fleet_are_found(
    ros_fleet: Fleet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "17")
    ros, domain, *vehicles = check_host(ros_fleet)
    assert (ros.name, ros.status) == ("ros", HealthStatus.OK)
    assert "wheels in " in ros.message or "sourced from " in ros.message
    assert domain.message == "17, by ROS_DOMAIN_ID"
    assert {vehicle.name for vehicle in vehicles} == {
        f"ros {vehicle.id}" for vehicle in ros_fleet.vehicles.values() if vehicle.arbiter == "ros"
    }


def test_wheels_and_a_sourced_ros_are_an_error(
    ros_fleet: Fleet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "share" / "rclpy").mkdir(parents=True)
    monkeypatch.setattr(importlib.metadata, "distribution", lambda _: None)  # wheels
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    for fleet in (ros_fleet, None):
        (check,) = check_host(fleet)
        assert check.status is HealthStatus.ERROR
        assert "there are two ROS 2" in check.message
        assert "without sourcing ROS" in check.remedy


def test_interfaces_that_are_missing_are_an_error(
    ros_fleet: Fleet, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(package: str) -> None:
        raise RosError(f"the ROS package {package} is not installed; build it")

    monkeypatch.setattr(host_checks, "require_interfaces", missing)
    (check,) = check_host(ros_fleet)
    assert (check.status, check.remedy) == (HealthStatus.ERROR, "build it")
    assert "m2pem_interfaces" in check.message


def test_without_ros_a_host_is_right_for_other_fleets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_checks, "installed_as", lambda: "")
    (check,) = check_host(None)
    assert check.status is HealthStatus.OK


@pytest.mark.parametrize("domain", ["233", "-1", "two"])
def test_a_domain_that_is_none_is_an_error(
    ros_fleet: Fleet, monkeypatch: pytest.MonkeyPatch, domain: str
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    assert check_host(ros_fleet)[-1].status is HealthStatus.ERROR
