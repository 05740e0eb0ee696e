"""A first script with pymavlink runs on the face as it does on an autopilot."""

import asyncio
import sys
from pathlib import Path

import mavlink_first_script
import pytest
from mavlink_gcs import gateway
from mavlink_mavsdk_world import free_port


@pytest.mark.tried_with(
    "pymavlink",
    "runs a first script on the MAVLink face: GUIDED, arm, take off, a target, a mission, land",
    kind="MAVLink clients",
    result="to its end",
    package="pymavlink",
)
def test_a_first_script_of_pymavlink_flies_a_copter(tmp_path: Path) -> None:
    async def main() -> None:
        port = free_port()
        links = [{"url": f"udpout://127.0.0.1:{port}", "vehicles": ["uav1"]}]
        async with gateway(tmp_path, speed=5.0, commands="all", links=links) as (control, _):
            script = mavlink_first_script.__file__
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, script, f"udpin:127.0.0.1:{port}"),
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
            )
            try:
                async with asyncio.timeout(120):
                    said, _ = await process.communicate()
            finally:
                if process.returncode is None:
                    process.kill()
            assert process.returncode == 0, said.decode()
            assert "landed" in said.decode()
            began = [each.mission.split(" of ")[0] for each in await control.runs()]
            assert began == ["takeoff", "goto", "plan", "land"]

    asyncio.run(main())
