"""The schedule over ROS, as a client in plain rclpy sees it."""

from mocu_world import Client, World, staged

from m2pem.api import When
from m2pem.testing import scenarios

HOLD, RELEASE, CANCEL, START = 1, 2, 3, 4
ADDED, CHANGED, HELD, RELEASED = 1, 2, 4, 5
IS_HELD, CANCELLED = 4, 6
INFO = 20
QUESTION = scenarios.question("Go on?")


async def test_a_client_lists_holds_starts_and_cancels_what_is_scheduled(client: Client) -> None:
    async with staged(client.domain, serves_schedule=True) as world:
        control = world.control
        await client.hears("schedule", lambda each: bool(each["served"]))
        when = When(cron="0 8 * * *", time_zone="UTC", starting_deadline_s=90)
        assert await control.schedule(QUESTION, when=when, priority=3, by="ada") == "s1"
        added = (await client.hears("schedule_events", lambda e: e["kind"] == ADDED))["entry"]
        assert (added["entry"], added["cron"], added["priority"]) == ("s1", "0 8 * * *", 3)
        assert (added["by"], added["starting_deadline_s"]) == ("ada", 90.0)
        assert (added["when"], added["next"]["sec"] % 86_400) == ("by cron 0 8 * * * (UTC)", 28_800)

        async def asks(verb: int, entry: str = "s1", **more: str) -> dict[str, object]:
            fields = {"verb": verb, "entry": entry, "by": "anna", **more}
            return await client.call("control_schedule", **fields)

        news = await client.hears("rosout", lambda e: "s1 is scheduled by ada" in e["msg"])
        assert news["level"] == INFO
        assert (await asks(HOLD, reason="rain"))["success"]
        held = await client.hears(
            "schedule_events",
            lambda e: e["kind"] == CHANGED and e["entry"]["status"] == IS_HELD,
        )
        assert held["entry"]["reason"] == "held by anna: rain"
        refused = await asks(START)
        assert "release it first" in str(refused["message"])
        assert (await asks(RELEASE))["success"]
        started = await asks(START)
        assert (started["success"], started["run"]) == (True, "r1")
        await client.hears("schedule_events", lambda e: e["entry"]["run"] == "r1")
        assert (await asks(HOLD, ""))["success"]
        assert (await client.hears("schedule_events", lambda e: e["kind"] == HELD))["hold"] == (
            "held by anna"
        )
        assert (await asks(RELEASE, ""))["success"]
        await client.hears("schedule_events", lambda e: e["kind"] == RELEASED)
        assert (await asks(CANCEL))["success"]
        assert (await asks(CANCEL))["message"] == "s1 is cancelled by anna"
        listed = await client.call("list_schedule")
        (entry,) = listed["schedule"]["entries"]
        assert (entry["status"], entry["reason"]) == (CANCELLED, "cancelled by anna")
        assert [each["run"] for each in entry["times"]] == ["r1"]
        open_only = await client.call("list_schedule", open_only=True)
        assert open_only["schedule"]["entries"] == []


async def test_what_makes_no_sense_is_refused(world: World, client: Client) -> None:
    unknown = await client.call("control_schedule", verb=9, entry="s1")
    assert "give one of: HOLD (1), RELEASE (2), CANCEL (3), START (4)" in unknown["message"]
    nothing = await client.call("control_schedule", verb=CANCEL)
    assert nothing["message"] == "entry is empty: say which, for example s1"
    there_is_none = await client.call("control_schedule", verb=START, entry="s1")
    assert "there is no entry 's1' in the schedule" in there_is_none["message"]
