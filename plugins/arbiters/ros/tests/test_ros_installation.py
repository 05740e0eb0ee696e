"""What is said where ROS is missing, is there twice, or cannot be loaded."""

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import pytest
from m2pem_plugin_ros.installation import (
    RosError,
    installed_as,
    require_interfaces,
    require_ros,
)


def test_what_is_installed_is_found() -> None:
    require_ros()
    assert require_interfaces("m2pem_interfaces").msg.KeyValue(key="a").key == "a"


def test_the_runtime_says_what_to_install_where_there_is_no_ros() -> None:
    # As in an environment without it: no module of that name is found.
    program = (
        "import sys; sys.modules['rclpy'] = None\n"
        "from m2pem_plugin_ros.installation import RosError\n"
        "try:\n    import m2pem_plugin_ros.runtime\n"
        "except RosError as error:\n    print(error)"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, check=True
    )
    assert "ROS 2 is not installed for this Python" in ended.stdout
    assert "source /opt/ros/jazzy/setup.bash" in ended.stdout
    assert "pip install 'm2pem-plugin-ros[wheels]'" in ended.stdout


def test_wheels_and_a_sourced_ros_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "share" / "rclpy").mkdir(parents=True)
    monkeypatch.setattr(importlib.metadata, "distribution", lambda _: None)  # wheels
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}")
    with pytest.raises(RosError, match=f"two ROS 2: wheels in .*, and sourced from {tmp_path}"):
        require_ros()


@pytest.mark.parametrize(
    ("distribution", "python", "remedy"),
    [
        ("humble", "3.10", "m2pem needs Python 3.11 or newer: use ROS 2 Jazzy or newer"),
        ("rolling", "3.99", "make the environment of m2pem with `python3.99 -m venv`"),
    ],
)
def test_a_sourced_ros_of_another_python_is_refused(
    distribution: str,
    python: str,
    remedy: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "share" / "rclpy").mkdir(parents=True)
    (tmp_path / "lib" / f"python{python}" / "site-packages" / "rclpy").mkdir(parents=True)
    _without_wheels(monkeypatch)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}")
    monkeypatch.setenv("ROS_DISTRO", distribution)
    with pytest.raises(RosError) as refused:
        require_ros()
    ours = ".".join(map(str, sys.version_info[:2]))
    assert str(refused.value) == (
        f"ROS 2 {distribution.capitalize()} of {tmp_path} was built for Python {python}, and this "
        f"is Python {ours}; {remedy}"
    )


def test_a_sourced_ros_of_this_python_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As setup.bash has it: its packages are in PYTHONPATH."""
    ours = ".".join(map(str, sys.version_info[:2]))
    packages = tmp_path / "lib" / f"python{ours}" / "site-packages"
    (tmp_path / "share" / "rclpy").mkdir(parents=True)
    (packages / "rclpy").mkdir(parents=True)
    (packages / "rclpy" / "__init__.py").write_text("")
    _without_wheels(monkeypatch)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}")
    monkeypatch.setattr(sys, "path", [str(packages), *sys.path])
    monkeypatch.delitem(sys.modules, "rclpy", raising=False)
    require_ros()
    assert sys.modules["rclpy"].__file__ == str(packages / "rclpy" / "__init__.py")
    assert installed_as() == f"sourced from {tmp_path}"


def _without_wheels(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "distribution", missing)


def test_libraries_that_are_not_found_are_explained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "rclpy.py").write_text("raise ImportError('librcl.so: cannot open')")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.delitem(sys.modules, "rclpy", raising=False)
    with pytest.raises(RosError, match=r"cannot be loaded: librcl\.so: cannot open; "):
        require_ros()


def test_interfaces_that_are_missing_are_named() -> None:
    with pytest.raises(RosError, match=r"nav3_msgs is not installed .* ros-jazzy-nav3-msgs"):
        require_interfaces("nav3_msgs")


def test_interfaces_of_an_earlier_m2pem_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(require_interfaces("m2pem_interfaces").msg, "FleetState")
    with pytest.raises(RosError, match=r"earlier m2pem: it has no FleetState; install it again"):
        require_interfaces("m2pem_interfaces")
