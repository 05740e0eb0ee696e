"""What watches the list of alerts goes on after an error, and says it once."""

import asyncio
import logging

import pytest

from m2pem.api.alerts import AlertsChanged
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.runs import Alert
from m2pem.executive.alert_list import AlertList
from m2pem.executive.alert_watch import watch_alerts
from m2pem.journal import MemoryJournal


def test_a_look_that_fails_does_not_end_the_watch(caplog: pytest.LogCaptureFixture) -> None:
    looks = 0
    published: list[AlertsChanged] = []

    async def story(clock: VirtualClock) -> None:
        alerts = AlertList("fleet", MemoryJournal(), lambda: 1)

        def look() -> None:
            nonlocal looks
            looks += 1
            if looks < 4:
                raise RuntimeError("a state that no condition expects")
            if looks == 4:
                alerts.add(Alert("", "LOGGED", "the battery is warm"))

        watching = asyncio.create_task(watch_alerts(alerts, look, published.append))
        while not published and not watching.done():
            await clock.sleep(0.1)
        watching.cancel()

    with caplog.at_level(logging.ERROR, "m2pem.alerts"):
        run_virtual(story, 1_000_000)
    assert published
    assert looks >= 4
    assert len(caplog.records) == 1
