"""Estimates of a drawing over REST."""

from pathlib import Path

from rest_world import VIGNETTE, rest_world


async def test_a_drawing_is_estimated_by_vehicle_and_task(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        found = await rest.post("/estimates", {"xml": VIGNETTE}, headers={"x-role": "viewer"})
        [vehicle] = found["vehicles"]
        assert vehicle["vehicle"] == "evsg1"
        tasks = {each["element"]: each for each in found["tasks"]}
        assert 60 < tasks["DriveRoute"]["time_s"] < found["time_s"] + 1
        assert "UserSendRoute" in {each["element"] for each in found["left_out"]}
        refused = await rest.post("/estimates", {"xml": "<no"}, 422)
        assert refused["findings"]
        await rest.post("/estimates", {"xml": VIGNETTE, "process": "nowhere"}, 422)
