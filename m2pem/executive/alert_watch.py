"""Looks at what is so now, tells operators when the list of alerts has changed, and keeps it."""

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress

from m2pem.api.alerts import AlertsChanged
from m2pem.errors import JournalError
from m2pem.executive.alert_list import AlertList
from m2pem.executive.emergency import WRITTEN_WITHIN_S

log = logging.getLogger("m2pem.alerts")

LOOK_EVERY_S = 0.5
PUBLISHED_EVERY_S = 0.1
"""Events that the list has changed are published no more often, however many alerts come."""

WRITE_AGAIN_S = 5.0


async def watch_alerts(
    alerts: AlertList, look: Callable[[], None], publish: Callable[[AlertsChanged], None]
) -> None:
    """Look, and publish an event after each change, for ever. `look`: updates the list. An error in
    it is logged once, and it is called again: the next alerts must not be missed."""
    changed = asyncio.Event()
    alerts.on_change = changed.set
    known, fails = alerts.changes, False
    while True:
        try:
            look()
            fails = False
        except Exception:
            if not fails:
                log.exception("the conditions of alerts cannot be looked at; the list may be old")
            fails = True
        if alerts.changes != known:
            known = alerts.changes
            publish(AlertsChanged())
        changed.clear()
        await asyncio.sleep(PUBLISHED_EVERY_S)
        with suppress(TimeoutError):
            async with asyncio.timeout(LOOK_EVERY_S - PUBLISHED_EVERY_S):
                await changed.wait()


async def keep_alerts(alerts: AlertList, is_replaced: Callable[[], bool] = lambda: False) -> None:
    """Have the journal keep the list, for ever; what it does not write is written later.

    `is_replaced`: whether another executive has the list now, which this one must not write over.
    """
    written, said = -1, False
    while True:
        if alerts.changes != written and not is_replaced():
            changes = alerts.changes
            try:
                await alerts.write()
            except JournalError as error:
                if not said:
                    log.warning("the journal does not keep the alerts: %s", error)
                said = True
                await asyncio.sleep(WRITE_AGAIN_S)
                continue
            written, said = changes, False
        await asyncio.sleep(LOOK_EVERY_S)


async def write_alerts(alerts: AlertList) -> None:
    """Have the journal keep the list at the end; what fails then was said before."""
    with suppress(JournalError, TimeoutError):
        async with asyncio.timeout(WRITTEN_WITHIN_S):
            await alerts.write()
