"""The files of deploy/ and docs/deploying.md agree with m2pem and with each other."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from configparser import RawConfigParser
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from tests.command_line import CommandLine, command_line

REPOSITORY = Path(__file__).parents[1]
DEPLOY = REPOSITORY / "deploy"
DOCKERFILE = (DEPLOY / "Dockerfile").read_text(encoding="utf-8")
PAGE = (REPOSITORY / "docs" / "deploying.md").read_text(encoding="utf-8")
SERVICES = ("executive", "executive-ros")


@pytest.fixture
def m2pem(tmp_path: Path) -> Iterator[CommandLine]:
    yield from command_line(tmp_path)


def service(name: str) -> dict[str, Any]:
    compose = YAML(typ="safe").load(DEPLOY / "compose.yaml")
    found: dict[str, Any] = compose["services"][name]
    return found


def stages() -> dict[str, str]:
    """The text of each stage of the Dockerfile by its name."""
    parts = re.split(r"^FROM (.+) AS ([\w-]+)$", DOCKERFILE, flags=re.M)
    return dict(zip(parts[2::3], parts[3::3], strict=True))


def test_images_come_from_short_names() -> None:
    known = {"python:3.11", "python:3.11-slim"}
    for image in re.findall(r"^FROM (\S+)", DOCKERFILE, re.M):
        assert image in known | set(stages())


@pytest.mark.parametrize("stage", ["executive", "ros"])
def test_an_image_ends_as_a_user_without_rights(stage: str) -> None:
    assert re.findall(r"^USER (.+)$", stages()[stage], re.M) == ["10001:10001"]
    assert stages()[stage].rstrip().endswith("USER 10001:10001")
    assert "--uid 10001" in stages()["base"]


def test_what_the_dockerfile_takes_of_the_clone_is_there() -> None:
    ignored = (REPOSITORY / ".dockerignore").read_text(encoding="utf-8").split()
    for path in ("constraints.txt", "ros/constraints.txt", "ros/m2pem_interfaces", "plugins"):
        assert path in DOCKERFILE
        assert (REPOSITORY / path).exists()
        assert not {path, path.partition("/")[0]} & set(ignored)


@pytest.mark.parametrize("name", SERVICES)
def test_a_container_has_a_read_only_root_and_no_capability(name: str) -> None:
    found = service(name)
    assert found["read_only"] is True
    assert found["cap_drop"] == ["ALL"]
    assert found["security_opt"] == ["no-new-privileges:true"]
    assert "journal:/var/lib/m2pem" in found["volumes"]
    assert found["environment"]["M2PEM_WEB_HOST"] == "${M2PEM_WEB_HOST:-127.0.0.1}"
    assert found["build"]["target"] in stages()
    assert (DEPLOY / found["build"]["context"]).resolve() == REPOSITORY
    assert found["tmpfs"][0].partition(":")[0] == "/run/m2pem"


def test_ros_is_a_profile() -> None:
    assert service("executive-ros")["profiles"] == ["ros"]
    assert "profiles" not in service("executive")


@pytest.fixture(params=["m2pem.service", "m2pem-arbiter-host.service"])
def unit(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A unit with a program that is here: systemd-analyze looks for it."""
    text = (DEPLOY / request.param).read_text(encoding="utf-8")
    file = tmp_path / request.param
    file.write_text(text.replace("/opt/m2pem/bin/m2pem", sys.executable))
    return file


@pytest.mark.tried_with(
    "systemd",
    "`systemd-analyze verify` and `security` of the units",
    kind="Platforms",
    result="accepted",
    version="252",
)
def test_systemd_accepts_the_unit_and_finds_it_hardened(unit: Path) -> None:
    if not shutil.which("systemd-analyze"):
        pytest.fail("needs systemd-analyze: run `make setup`, or install systemd")
    verified = subprocess.run(
        ["systemd-analyze", "verify", unit], capture_output=True, text=True, check=False
    )
    assert unit.name not in verified.stderr
    assert verified.returncode == 0, verified.stderr
    judged = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", "--threshold=20", "--no-pager", unit],
        capture_output=True,
        text=True,
        check=False,
    )
    assert judged.returncode == 0, judged.stdout[-500:]


def read(unit: Path) -> RawConfigParser:
    parser = RawConfigParser(strict=False)
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read(unit)
    return parser


def test_a_unit_that_ends_leaves_the_locks_of_the_other_one(unit: Path) -> None:
    """Else a second executive could command the vehicles of the first."""
    service = read(unit)["Service"]
    assert service["RuntimeDirectory"] == "m2pem"
    assert service["RuntimeDirectoryPreserve"] == "yes"


def test_the_unit_and_the_containers_serve_with_options_that_exist(m2pem: CommandLine) -> None:
    unit = read(DEPLOY / "m2pem.service")
    program, *words = unit["Service"]["ExecStart"].split()
    assert program == "/opt/m2pem/bin/m2pem"
    assert f"python3 -m venv {Path(program).parents[1]}\n" in PAGE
    status, usage, _ = m2pem.run("serve", "--help")
    assert status == 0
    for command in (words, *(service(name)["command"] for name in SERVICES)):
        assert command[0] == "serve"
        assert all(word in usage for word in command if word.startswith("--"))


def test_the_unit_of_a_host_has_options_that_exist(m2pem: CommandLine) -> None:
    unit = read(DEPLOY / "m2pem-arbiter-host.service")
    _, command, *words = unit["Service"]["ExecStart"].split()
    status, usage, _ = m2pem.run(command, "--help")
    assert status == 0
    assert all(word in usage for word in words if word.startswith("--"))


def test_every_file_and_variable_of_the_page_is_there() -> None:
    compose = (DEPLOY / "compose.yaml").read_text(encoding="utf-8")
    for file in re.findall(r"\b(?:deploy|fleet_configs)/[\w./]*\w", PAGE):
        assert (REPOSITORY / file).exists() or file.startswith("deploy/fleet")
    for variable in re.findall(r"^\| `(M2PEM_\w+|ROS_\w+)`", PAGE, re.M):
        assert f"${{{variable}:-" in compose


def test_the_fleet_of_the_page_can_be_used_where_it_is_copied_to(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    copying = re.search(r"^(mkdir --parents deploy/fleet.*\n.*)\n", PAGE, re.M)
    assert copying is not None
    shutil.copytree(REPOSITORY / "fleet_configs", tmp_path / "fleet_configs")
    (tmp_path / "deploy").mkdir()
    subprocess.run(["bash", "-ec", copying[1]], cwd=tmp_path, check=True)
    words = ("--fleet", "deploy/fleet/fleet.yaml", "--journal", "journal.db")
    (tmp_path / "runtime").mkdir(mode=0o700)
    status, out, _ = m2pem.run(
        "doctor", *words, M2PEM_RUNTIME_DIR=str(tmp_path / "runtime"), M2PEM_BLOCK_PLUGINS="all"
    )
    assert status == 0, out


def test_it_serves_without_rights_on_a_read_only_root() -> None:
    """As a container runs it: only its home, its folder of locks and /tmp can be written.

    The user is 10001 if root runs the tests and that user may start this Python; else root without
    any capability, of a user namespace if another user runs the tests.
    """
    isolated = ["unshare", *([] if os.geteuid() == 0 else ["--map-root-user"]), "--mount"]
    # Through a shell: setpriv itself still has its capabilities when it starts a program.
    unprivileged = ["setpriv", "--reuid=10001", "--regid=10001", "--clear-groups", "bash", "-c"]
    started = subprocess.run([*unprivileged, "$0 -c ''", sys.executable], check=False)
    user = 10001 if started.returncode == 0 else 0
    script = f"""
        set -e
        mount --make-rprivate /
        mount -t tmpfs -o mode=0700,uid={user},gid={user} tmpfs /var/lib
        mount -t tmpfs -o mode=0700,uid={user},gid={user} tmpfs /run
        mount -t tmpfs -o mode=1777 tmpfs /mnt
        mount -o remount,ro,bind /
        cd /var/lib
        exec setpriv --reuid {user} --regid {user} --clear-groups --no-new-privs \
          --bounding-set=-all --inh-caps=-all \
          env TMPDIR=/mnt HOME=/var/lib XDG_STATE_HOME=/var/lib \
          M2PEM_RUNTIME_DIR=/run PYTHONPATH="$PYTHONPATH" bash -ec '
          if touch /etc/m2pem-was-here 2>/dev/null; then exit 9; fi
          "$1" -m m2pem serve --fleet "$2" --simulate --ocu none &
          serving=$!
          until "$1" -m m2pem doctor --running; do kill -0 $serving; done
          kill -TERM $serving
          wait $serving' serve "$@"
    """
    done = subprocess.run(
        [
            *(*isolated, "bash", "-c", script, "container"),
            *(sys.executable, str(REPOSITORY / "fleet_configs" / "vignette1.yaml")),
        ],
        env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"ok +executive \d+: journal +/var/lib/m2pem/journal.db writes", done.stdout)
