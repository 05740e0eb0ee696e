"""`make setup` ends with what went wrong when Debian packages cannot be installed."""

import os
import subprocess
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]


@pytest.mark.parametrize("fails_at", ["update", "install"])
def test_packages_that_cannot_be_installed_fail_the_setup(tmp_path: Path, fails_at: str) -> None:
    for name, script in {
        "apt-get": f'[ "$1" != {fails_at} ] || {{ echo "E: no network" >&2; exit 100; }}',
        "id": "echo 0",
    }.items():
        program = tmp_path / name
        program.write_text(f"#!/bin/sh\n{script}\n")
        program.chmod(0o755)
    done = subprocess.run(
        ["make", "npm-packages", "DEBIAN_PACKAGES=m2pem-no-such-program"],
        cwd=REPOSITORY,
        env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert "E: no network" in done.stderr
    assert "apt-get could not install m2pem-no-such-program" in done.stderr
    assert "make setup again" in done.stderr
