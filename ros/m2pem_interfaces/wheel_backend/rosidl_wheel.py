"""Builds a ROS 2 interface package into a wheel (PEP 517), over the wheels of ROS itself.

The package's own CMakeLists.txt does the work. The wheel has the layout of the wheels of ROS: the
Python package in site-packages; lib, share and include in the prefix of the environment.
"""

import importlib.util
import io
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from wheel.wheelfile import WheelFile

PACKAGE = Path(__file__).resolve().parent.parent
SOURCES = (
    "package.xml",
    "CMakeLists.txt",
    "pyproject.toml",
    "msg",
    "srv",
    "action",
    "wheel_backend",
)
PREFIX_FOLDERS = ("lib", "share", "include")

Settings = Mapping[str, object] | None


@dataclass(frozen=True, slots=True)
class Project:
    """What is built. `ros_name` is that of package.xml; names of archives begin with `stem`."""

    ros_name: str
    stem: str
    metadata: str


def build_wheel(
    wheel_directory: str, config_settings: Settings = None, metadata_directory: str | None = None
) -> str:
    """The hook of PEP 517: build the wheel and return its name.

    Raises:
        SystemExit: a compiler, Python's headers or the wheels of ROS are missing.
        subprocess.CalledProcessError: the build failed; it has said why.
    """
    project = _project()
    tag = _tag()
    with tempfile.TemporaryDirectory(prefix="rosidl_wheel_") as folder:
        installed = _build(project, Path(folder))
        content = _arrange(project, installed, Path(folder) / "content", tag)
        name = f"{project.stem}-{tag}.whl"
        with WheelFile(Path(wheel_directory) / name, "w") as wheel:
            wheel.write_files(content)
    return name


def build_sdist(sdist_directory: str, config_settings: Settings = None) -> str:
    """The hook of PEP 517: pack the sources and return the archive's name."""
    project = _project()
    name = f"{project.stem}.tar.gz"
    with tarfile.open(Path(sdist_directory) / name, "w:gz") as archive:
        for source in SOURCES:
            archive.add(PACKAGE / source, f"{project.stem}/{source}", filter=_without_caches)
        info = tarfile.TarInfo(f"{project.stem}/PKG-INFO")
        info.size = len(project.metadata.encode())
        archive.addfile(info, io.BytesIO(project.metadata.encode()))
    return name


def _without_caches(entry: tarfile.TarInfo) -> tarfile.TarInfo | None:
    return None if "__pycache__" in entry.name else entry


def _project() -> Project:
    declared = tomllib.loads((PACKAGE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    manifest = (PACKAGE / "package.xml").read_text(encoding="utf-8")
    ros_name = re.search(r"<name>\s*(\w+)\s*</name>", manifest)
    if ros_name is None:
        raise SystemExit(f"{PACKAGE / 'package.xml'} has no <name>")
    headers = {
        "Metadata-Version": "2.1",
        "Name": declared["name"],
        "Version": declared["version"],
        "Summary": declared["description"],
        "Requires-Python": declared["requires-python"],
    }
    lines = [f"{key}: {value}" for key, value in headers.items()]
    lines += [f"Requires-Dist: {dependency}" for dependency in declared["dependencies"]]
    distribution = re.sub(r"[-_.]+", "_", declared["name"]).lower()
    metadata = "\n".join(lines) + "\n"
    return Project(ros_name[1], f"{distribution}-{declared['version']}", metadata)


def _tag() -> str:
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"


def _build(project: Project, folder: Path) -> Path:
    """Configure, compile and install the package; returns where it is installed."""
    prefix = _ros_prefix()
    path = os.pathsep.join([str(prefix / "bin"), os.environ.get("PATH", os.defpath)])
    # A ROS that happens to be sourced must not get in: the two are not built alike.
    environment = {
        **os.environ,
        "PATH": path,
        "AMENT_PREFIX_PATH": str(prefix),
        "CMAKE_PREFIX_PATH": str(prefix),
    }
    _check_compiler(path)
    cmake = shutil.which("cmake", path=path) or "cmake"
    build, installed = folder / "build", folder / "installed"
    options = {
        "CMAKE_BUILD_TYPE": "Release",
        "BUILD_TESTING": "OFF",
        "CMAKE_INSTALL_PREFIX": installed,
        f"CMAKE_PROJECT_{project.ros_name}_INCLUDE": Path(__file__).with_name(
            "present_includes.cmake"
        ),
        "Python3_EXECUTABLE": sys.executable,
        "PYTHON_EXECUTABLE": sys.executable,
    }
    configure = [cmake, "-S", PACKAGE, "-B", build, "-G", "Ninja", "-Wno-dev"]
    configure += [f"-D{name}={value}" for name, value in options.items()]
    subprocess.run(configure, check=True, env=environment)
    subprocess.run([cmake, "--build", build, "--target", "install"], check=True, env=environment)
    return installed


def _ros_prefix() -> Path:
    """Where pip put the wheels of ROS: an environment of its own for builds, or this one."""
    spec = importlib.util.find_spec("rosidl_adapter")
    for parent in Path(spec.origin).parents if spec and spec.origin else ():
        if (parent / "share" / "rosidl_cmake" / "cmake").is_dir():
            return parent
    raise SystemExit("the wheels of ROS (ros-rosidl-...) are not in the build environment")


def _check_compiler(path: str) -> None:
    missing = [name for name in ("cc", "c++") if shutil.which(name, path=path) is None]
    if not (Path(sysconfig.get_path("include")) / "Python.h").exists():
        missing.append("Python.h")
    if missing and not {"CC", "CXX"} <= os.environ.keys():
        raise SystemExit(
            f"to build interfaces of ROS, {', '.join(missing)} is missing; "
            "on Debian: apt-get install build-essential python3-dev"
        )


def _arrange(project: Project, installed: Path, content: Path, tag: str) -> Path:
    """Lay out what was installed as it stands in a wheel; returns the folder."""
    packages = [p for p in installed.rglob(f"site-packages/{project.ros_name}") if p.is_dir()]
    sources = shutil.ignore_patterns("__pycache__", "*.c")
    shutil.copytree(packages[0], content / project.ros_name, ignore=sources)
    prefix = content / f"{project.stem}.data" / "data"
    for folder in PREFIX_FOLDERS:
        if (installed / folder).is_dir():
            python = shutil.ignore_patterns("python3*", "__pycache__")
            shutil.copytree(installed / folder, prefix / folder, ignore=python)
    info = content / f"{project.stem}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(project.metadata, encoding="utf-8")
    wheel = (
        "Wheel-Version: 1.0",
        "Generator: rosidl_wheel",
        "Root-Is-Purelib: false",
        f"Tag: {tag}",
    )
    (info / "WHEEL").write_text("\n".join(wheel) + "\n", encoding="utf-8")
    return content
