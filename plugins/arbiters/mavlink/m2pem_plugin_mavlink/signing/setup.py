"""Gives a vehicle its signing key, or takes it away (SETUP_SIGNING)."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from m2pem.api import SystemClock
from m2pem.errors import M2pemError
from m2pem_plugin_mavlink.link.routed_link import GROUND_STATION, RoutedLink, open_link
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.settings import Settings
from m2pem_plugin_mavlink.signing.key_file import read_key
from m2pem_plugin_mavlink.signing.policy import SigningPolicy
from m2pem_plugin_mavlink.signing.signature import Refusal

RECEIVED_WITHIN_S = 5.0
REPEAT_S = 1.0
TIMES = 5
"""SETUP_SIGNING is not acknowledged: it is sent again until the frames of the vehicle show it."""

HEARTBEAT = message_type("HEARTBEAT").id
STATUSTEXT = message_type("STATUSTEXT").id


class SetupError(M2pemError):
    """The vehicle does not take or give up its key; the text says why."""


async def set_up_key(settings: Settings, key: SigningPolicy, old: SigningPolicy | None) -> None:
    """Give the vehicle a key, over frames that are signed with its old one, if it has one.

    Raises:
        SetupError: it is not received, or does not sign afterwards.
        PluginError: a URL or a key cannot be used.
    """
    secret = read_key(key.key)
    # Later than all that m2pem and the vehicle have sent with this key, or with the old one.
    async with _link(settings, key) as link:
        earliest = link.signing_time()
    texts = await _send(settings, old, secret, earliest)
    async with _link(settings, key) as link:
        if await _received(link):
            return
        found = {each.refusal for each in link.refused()}
    if Refusal.WRONGLY_SIGNED in found:
        raise SetupError(f"it signs with another key than {key.key}: name it with --old-key")
    raise SetupError(f"it does not sign its messages{_said(texts)}")


async def remove_key(settings: Settings, key: SigningPolicy) -> None:
    """Take the key away from the vehicle, over frames that are signed with it.

    Raises:
        SetupError: it is not received, or signs afterwards.
        PluginError: a URL or a key cannot be used.
    """
    texts = await _send(settings, key, bytes(32), None)
    async with _link(settings, key) as link:
        # Its frames are refused once they have no signature.
        if not await _until(lambda: any(r.refusal is Refusal.NOT_SIGNED for r in link.refused())):
            raise SetupError(f"it still signs its messages{_said(texts)}")


@asynccontextmanager
async def _link(settings: Settings, signing: SigningPolicy | None) -> AsyncIterator[RoutedLink]:
    address = Address(settings.system_id, settings.component_id)
    source = Address(settings.gcs_system_id, GROUND_STATION.component)
    link = await open_link(address, settings.urls, SystemClock(), source, signing=signing)
    try:
        yield link
    finally:
        await link.close()


async def _send(
    settings: Settings, signing: SigningPolicy | None, secret: bytes, earliest: int | None
) -> list[str]:
    """Send SETUP_SIGNING until the vehicle's frames are no longer as before, or for a while; return
    what the vehicle said meanwhile."""
    texts: list[str] = []
    async with _link(settings, signing) as link:

        def read(message: Message, sender: Address) -> None:
            if sender == link.address:
                texts.append(message.text.decode(errors="replace"))

        link.listen((STATUSTEXT,), read)
        if not await _received(link):
            refused = ", ".join(sorted({each.refusal for each in link.refused()}))
            raise SetupError(
                f"its messages are refused: {refused}"
                if refused
                else f"no message of system {settings.system_id} arrives on "
                f"{', '.join(settings.urls)}; if it has a key, name it with --old-key"
            )
        message = message_type("SETUP_SIGNING").make(
            target_system=settings.system_id,
            target_component=settings.component_id,
            secret_key=tuple(secret),
            initial_timestamp=0 if earliest is None else max(earliest, link.signing_time()),
        )
        for _ in range(TIMES if signing is not None else 2):
            link.send(message)
            if await _until(lambda: bool(link.refused()), REPEAT_S) or texts:
                break
    return texts


async def _received(link: RoutedLink) -> bool:
    """Wait for a heartbeat of the vehicle."""
    senders: set[Address] = set()
    stop = link.listen((HEARTBEAT,), lambda _, sender: senders.add(sender))
    try:
        return await _until(lambda: link.address in senders)
    finally:
        stop()


async def _until(true: Callable[[], bool], within_s: float = RECEIVED_WITHIN_S) -> bool:
    loop = asyncio.get_running_loop()
    end_s = loop.time() + within_s
    while not true():
        if loop.time() >= end_s:
            return False
        await asyncio.sleep(0.05)
    return True


def _said(texts: list[str]) -> str:
    return f"; it said: {'; '.join(texts)}" if texts else ""
