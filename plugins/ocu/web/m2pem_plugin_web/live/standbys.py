"""The executives that stand by for the one of this page, asked for again and again."""

import asyncio
import logging
import re
from collections.abc import Sequence
from dataclasses import replace

from m2pem.api import ExecutiveAddress, MissionControl
from m2pem.errors import M2pemError

EVERY_S = 2.0

_PAGE = re.compile(r"https?://[\w.:\[\]-]+/")

log = logging.getLogger("m2pem.ocu.web")


class Standbys:
    """`found`: the last answer; it stays when the journal cannot say more."""

    def __init__(self, control: MissionControl) -> None:
        self.found: Sequence[ExecutiveAddress] = ()
        self._control = control

    @property
    def pages(self) -> list[str]:
        """The addresses of their pages."""
        return [each.page for each in self.found if each.page]

    async def run(self) -> None:
        """Ask until cancelled."""
        while True:
            try:
                self.found = [with_page(each) for each in await self._control.standbys()]
            except M2pemError as error:
                log.info("who stands by is not known: %s", error)
            await asyncio.sleep(EVERY_S)


def with_page(executive: ExecutiveAddress) -> ExecutiveAddress:
    """Return it without an address of a page that is none: another program may have written it."""
    return executive if _PAGE.fullmatch(executive.page) else replace(executive, page="")
