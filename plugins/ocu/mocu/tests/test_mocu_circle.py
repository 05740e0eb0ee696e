"""Two runs wait for each other: a client stops one of them over DDS, and the other completes."""

from pathlib import Path

from mocu_world import Client, World

from m2pem.api import RunStatus
from tests.waiting_circle import GO, NONE_GOES_ON, holding_and_waiting

STOP = 1


async def test_an_operator_stops_one_of_two_runs_that_wait_for_each_other(
    world: World, client: Client, tmp_path: Path
) -> None:
    runs = []
    for holds, needs in (("ugv1", "ugv2"), ("ugv2", "ugv1")):
        file = tmp_path / f"{holds}.bpmn"
        file.write_bytes(holding_and_waiting(holds, needs))
        runs.append((await client.call("start_mission", url=str(file)))["run"])
    first, second = runs
    assert (await client.call("send_signal", signal=GO))["success"]
    alert = await client.hears("rosout", lambda each: NONE_GOES_ON in each["msg"])
    held = f"held by Hold of {second} (ugv2)"
    assert f"Need of {first} (ugv1) waits for ugv2 ({held})" in alert["msg"]
    assert f"`m2pem stop {second}`" in alert["msg"]
    assert (await client.call("control_run", verb=STOP, run=second, by="anna"))["success"]
    assert (await world.control.wait(second)).status is RunStatus.STOPPED
    assert (await world.control.wait(first)).status is RunStatus.TERMINATED
