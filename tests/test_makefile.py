"""`make` installs what a target needs, and ends with what went wrong when it cannot."""

import os
import subprocess
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
LIGHT = {
    "demo": {"plugins/ocu/terminal"},
    "demo-air": {"plugins/ocu/terminal", "plugins/arbiters/mavlink"},
    "demo-web": {"plugins/ocu/web"},
}


def make(*words: str, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run make in the repository; programs in `path` come before those of the machine."""
    before = f"{path}:" if path else ""
    return subprocess.run(
        ["make", *words],
        cwd=REPOSITORY,
        env={**os.environ, "PATH": f"{before}{os.environ['PATH']}", "MAKEFLAGS": ""},
        capture_output=True,
        text=True,
        check=False,
    )


def program(folder: Path, name: str, script: str) -> None:
    (folder / name).write_text(f"#!/bin/sh\n{script}\n")
    (folder / name).chmod(0o755)


def made_by_make(venv: Path, python: str) -> None:
    """An environment that make has made, of Python 3.11.0, which else does what `python` says."""
    (venv / "bin").mkdir(parents=True)
    program(venv / "bin", "python", f'[ "$1" != -V ] || {{ echo Python 3.11.0; exit; }}\n{python}')
    (venv / "created").write_text(f"{REPOSITORY} Python 3.11.0\n")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A folder of programs: the user is root, and apt-get lists what it is asked to install."""
    program(tmp_path, "id", "echo 0")
    program(
        tmp_path,
        "apt-get",
        f'echo "$@" >> {tmp_path}/asked\n'
        'case "$*" in *no-such*) echo "E: no such package" >&2; exit 100;; esac',
    )
    return tmp_path


def test_a_package_that_cannot_be_installed_is_named_and_the_others_are_installed(
    root: Path,
) -> None:
    wanted = "m2pem-absent-1 m2pem-no-such m2pem-absent-2"
    done = make("npm-packages", f"DEBIAN_PACKAGES={wanted}", path=root)
    assert done.returncode != 0
    asked = (root / "asked").read_text()
    assert "m2pem-absent-1" in asked
    assert "m2pem-absent-2" in asked
    assert "E: no such package" in done.stderr
    said = next(line for line in done.stderr.splitlines() if "could not install" in line)
    assert "m2pem-no-such" in said
    assert "absent" not in said
    assert "make setup again" in said


def test_root_is_told_of_each_package_that_is_installed(root: Path) -> None:
    done = make("npm-packages", "DEBIAN_PACKAGES=m2pem-absent-1", path=root)
    assert done.returncode == 0, done.stderr
    assert "You are root: installing the Debian package m2pem-absent-1" in done.stdout


def test_a_package_that_the_distribution_lacks_has_a_substitute(root: Path) -> None:
    done = make("npm-packages", "DEBIAN_PACKAGES=m2pem-no-such/m2pem-absent-1", path=root)
    assert done.returncode == 0, done.stderr
    assert "m2pem-absent-1" in (root / "asked").read_text()


def test_a_substitute_that_is_there_serves_where_no_package_is_known(root: Path) -> None:
    program(root, "apt-cache", "exit 100")
    done = make("npm-packages", "DEBIAN_PACKAGES=m2pem-no-such/id", path=root)
    assert done.returncode == 0, done.stderr
    assert not (root / "asked").exists()


def test_nothing_is_installed_for_another_user_than_root(root: Path) -> None:
    program(root, "id", "echo 1000")
    done = make("npm-packages", "DEBIAN_PACKAGES=m2pem-absent-1", path=root)
    assert done.returncode == 0, done.stderr
    assert not (root / "asked").exists()


@pytest.mark.parametrize("target", LIGHT)
def test_a_demonstration_installs_the_plugins_that_it_needs_alone(
    target: str, tmp_path: Path
) -> None:
    done = make("--dry-run", target, f"VENV={tmp_path}/venv")
    assert done.returncode == 0, done.stderr
    installing = [line for line in done.stdout.splitlines() if "-m pip" in line]
    words = " ".join(installing).split()
    assert {words[at + 1] for at, word in enumerate(words) if word == "--editable"} == {
        ".",
        *LIGHT[target],
    }


def test_an_environment_with_everything_is_not_changed_by_a_demonstration(tmp_path: Path) -> None:
    venv = tmp_path / "venv"
    made_by_make(venv, "exit 0")
    (venv / "installed").touch()
    done = make("--dry-run", "demo", f"VENV={venv}")
    assert done.returncode == 0, done.stderr
    assert "-m pip" not in done.stdout
    assert "m2pem demo" in done.stdout


def test_a_failed_installation_is_said_in_one_line_with_its_remedy(tmp_path: Path) -> None:
    venv = tmp_path / "venv"
    made_by_make(venv, '[ "$1" != -m ] || { echo "ERROR: no index" >&2; exit 1; }')
    done = make("demo", f"VENV={venv}")
    assert done.returncode != 0
    assert "ERROR: no index" in done.stderr
    assert "pip could not install what is needed" in done.stderr
    assert "Then the same make command again" in done.stderr


def test_an_environment_that_make_has_not_made_is_not_emptied(tmp_path: Path) -> None:
    venv = tmp_path / "venv"
    (venv / "lib").mkdir(parents=True)
    done = make("demo", f"VENV={venv}")
    assert done.returncode != 0
    assert f"{venv} was not made by make" in done.stderr
    assert f"rm -r {venv}" in done.stderr
    assert (venv / "lib").is_dir()


@pytest.mark.parametrize(("asked", "kept"), [((), True), (("PYTHON=python3.99",), False)])
def test_another_python_of_the_shell_empties_no_environment(
    tmp_path: Path, asked: tuple[str, ...], kept: bool
) -> None:
    venv = tmp_path / "venv"
    made_by_make(venv, "exit 0")
    for name in ("python3", "python3.99"):
        program(tmp_path, name, "echo Python 3.99.0")
    done = make("--dry-run", "dist", f"VENV={venv}", *asked, path=tmp_path)
    assert done.returncode == 0, done.stderr
    assert ("-m venv --clear" not in done.stdout) == kept
