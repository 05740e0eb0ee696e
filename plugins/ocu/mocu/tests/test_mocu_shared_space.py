"""Shared space over ROS: where it is, who has a place in it, and who waits."""

from pathlib import Path
from typing import Any

from mocu_world import Client, staged

from m2pem.fleet.fleet_file import load_fleet
from tests.deconfliction.test_clearance_simulate import both_ways, write_rovers


async def test_a_client_sees_who_is_on_the_bridge_and_who_waits_for_it(
    client: Client, tmp_path: Path
) -> None:
    def waited_for(message: dict[str, Any]) -> bool:
        return any(each["waiting"] for each in message["spaces"])

    async with staged(client.domain, load_fleet(write_rovers(tmp_path))) as world:
        run = await world.control.start(both_ways())
        (bridge,) = (await client.hears("shared_spaces", waited_for))["spaces"]
    assert (bridge["name"], bridge["capacity"]) == ("bridge", 1)
    assert bridge["domains"] == ["ground", "surface"]
    corners = [(each["latitude_deg"], each["longitude_deg"]) for each in bridge["points"]]
    assert corners == [
        (37.9999, -76.9996),
        (37.9999, -76.9994),
        (38.0001, -76.9994),
        (38.0001, -76.9996),
    ]
    assert bridge["holders"] == [{"vehicle": "one", "behavior": f"{run}.b1", "lost": False}]
    (task,) = bridge["waiting"]
    assert (task["run"], task["element"], task["behavior"]) == (run, "West", "goto")
    assert task["since"]["sec"] > 0
    assert "bridge (capacity 1)" in task["reason"]
