"""A real autopilot whose texts are signals, and that does what missions throw."""

import asyncio
from pathlib import Path

import mavlink_sitl as sitl
import pytest
from mavlink_gcs import gateway
from mavlink_mavsdk_world import free_port
from test_mavlink_face_events import TEXT, mission, outside

pytestmark = pytest.mark.sitl("M2PEM_ARDUCOPTER")

FLEET = """
version: 1
origin: {{lat: 47.397742, lon: 8.545594, alt: 488.0}}
vehicles:
  uav1:
    domain: air
    arbiter: mavlink
    sitl: true
    lost_after: 60 s
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}
"""
WITHIN_S = 120.0


def test_arducopter_answers_what_a_mission_throws_and_its_texts_are_signals(tmp_path: Path) -> None:
    async def main() -> None:
        binary = sitl.program("M2PEM_ARDUCOPTER")
        assert binary is not None
        port = free_port()
        call = {"signal": "drop", "type": "COMMAND_LONG", "to": "uav1"}
        # A mode that it does not have: it refuses, and says so.
        wrong = {"command": "DO_SET_MODE", "param1": 1, "param2": 99}
        settings = {
            "send_to": ["uav1"],
            "receive": [{**TEXT, "from": "uav1", "when": "contains(text, 'mode')"}],
            "send": [{**call, "fields": wrong, "done": "dropped", "failed": "stuck"}],
        }
        with sitl.running([sitl.ardupilot(binary, "quad", 0, port)], tmp_path):
            fleet = FLEET.format(port=port)
            async with (
                gateway(tmp_path, speed=sitl.SPEED, fleet=fleet, **settings) as (control, _),
                asyncio.timeout(WITHIN_S),
            ):
                async for state in control.telemetry():
                    if getattr(state, "ready", None):
                        break
                waits = await control.start(mission(("catch", "alarm")))
                throws = await control.start(mission(("throw", "drop"), ("catch", "stuck")))
                for run in (throws, waits):
                    assert str((await control.wait(run)).status) == "completed"
                assert "mavlink uav1 DO_SET_MODE" in await outside(control, throws)
                assert "mavlink uav1 STATUSTEXT" in await outside(control, waits)

    asyncio.run(main())
