"""The description of the API is true: schemathesis sends what it allows, and what it does not."""

import asyncio
import os
import sys
from pathlib import Path

import pytest
from web_world import MakeWorld

from m2pem.testing import scenarios

CONFIGURATION = """
[checks.positive_data_acceptance]
# Of a mission or a geometry, no schema says whether it is one: that is told with 422.
expected-statuses = ["2xx", "401", "403", "404", "409", "422", "429"]
"""


ALL_PHASES = "examples,coverage,fuzzing,stateful"


@pytest.mark.parametrize(
    ("phases", "examples"),
    [
        ("fuzzing", 2),
        pytest.param(ALL_PHASES, 100, marks=[pytest.mark.long, pytest.mark.timeout(1800)]),
    ],
)
@pytest.mark.tried_with(
    "Schemathesis",
    "sends what the description of the API allows, and what it does not",
    kind="Browsers and the web",
    result="answers as described",
    package="schemathesis",
)
async def test_the_description_of_the_api_is_true(
    world: MakeWorld, tmp_path: Path, phases: str, examples: int
) -> None:
    (tmp_path / "schemathesis.toml").write_text(CONFIGURATION)
    async with world() as here:
        await here.asked()
        (here.missions / "asks.bpmn").write_bytes(scenarios.question())
        browser = await here.browser()
        # Signing out would end all that comes after; signing in is slowed down on purpose.
        words = ["run", f"{here.base}/api/openapi.json", "--exclude-path", "/api/session"]
        words += ["-H", f"Cookie: {browser.cookie}", "-H", f"M2pem-Key: {browser.key}"]
        words += ["-H", f"Origin: {here.base}"]
        words += [
            "--phases",
            phases,
            "--max-examples",
            str(examples),
            "--seed",
            "1",
            "--request-timeout",
            "30",
        ]
        process = await asyncio.create_subprocess_exec(
            Path(sys.executable).with_name("schemathesis"),
            *("--config-file", str(tmp_path / "schemathesis.toml"), *words),
            cwd=tmp_path,
            env={**os.environ, "NO_COLOR": "1"},
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
        )
        try:
            said, _ = await process.communicate()
        finally:
            if process.returncode is None:
                process.kill()
        assert process.returncode == 0, said.decode()
        assert (await browser.http.get("/api/session")).status_code == 200
