"""The keys in use in an event loop, each with its timestamps."""

import asyncio
import logging
from pathlib import Path

from m2pem_plugin_mavlink.protocol.messages import message_type
from m2pem_plugin_mavlink.signing.key_file import SigningError, fingerprint, read_key
from m2pem_plugin_mavlink.signing.policy import SigningPolicy
from m2pem_plugin_mavlink.signing.signature import SignatureCheck, Signer, Signing
from m2pem_plugin_mavlink.signing.timestamps import TimestampStore

ALWAYS_UNSIGNED = ("RADIO_STATUS", "RADIO")
"""Radios send these by themselves, and have no key."""

_logger = logging.getLogger(__name__)


class Signers:
    """One key is one signer, whatever the number of vehicles and files that have it."""

    def __init__(self) -> None:
        self._stores: dict[Path | None, TimestampStore | None] = {None: None}
        self._signers: dict[tuple[Path | None, str], Signer] = {}
        self._signings: dict[tuple[Signer, int], Signing] = {}
        self._failed = False

    def checks(self, policy: SigningPolicy, count: int) -> list[SignatureCheck]:
        """Return the checks of the frames of a vehicle at its endpoints.

        Raises:
            SigningError: the key or the database of timestamps cannot be used, or there is no such
                message.
        """
        unsigned = _ids((*ALWAYS_UNSIGNED, *policy.accept_unsigned))
        components = frozenset(each for each in policy.accept_unsigned if isinstance(each, int))
        signer = self._signer(policy.state_folder, read_key(policy.key))
        return [
            SignatureCheck(self._signing(signer, policy.key, link_id), unsigned, components)
            for link_id in range(policy.link_id, policy.link_id + count)
        ]

    def _signer(self, folder: Path | None, key: bytes) -> Signer:
        if folder not in self._stores:
            assert folder is not None
            self._stores[folder] = TimestampStore(folder)
        name = fingerprint(key)
        found = self._signers.get((folder, name))
        if found is None:
            found = self._signers[folder, name] = Signer(key, self._stores[folder])
        return found

    def _signing(self, signer: Signer, key_file: Path, link_id: int) -> Signing:
        return self._signings.setdefault((signer, link_id), Signing(signer, key_file, link_id))

    async def keep(self) -> None:
        """Reserve further timestamps, and store those received, if it is time."""
        if any(each.timestamps.is_due for each in self._signers.values()):
            await self._store()

    async def close(self) -> None:
        """Store the timestamps, and forget all keys."""
        await self._store()
        stores, self._stores = self._stores, {None: None}
        self._signers, self._signings = {}, {}
        for store in stores.values():
            if store is not None:
                store.close()

    async def _store(self) -> None:
        for folder, store in list(self._stores.items()):
            if store is None:
                continue
            times = [each.timestamps for (of, _), each in self._signers.items() if of == folder]
            changes = [each.change() for each in times]
            try:
                await asyncio.to_thread(store.write, changes)
            except SigningError as error:
                if not self._failed:
                    _logger.warning("%s", error)
                self._failed = True
                continue
            self._failed = False
            for each, change in zip(times, changes, strict=True):
                each.stored(change)


def _ids(accepted: tuple[str | int, ...]) -> frozenset[int]:
    try:
        return frozenset(message_type(each).id for each in accepted if isinstance(each, str))
    except KeyError as error:
        raise SigningError(f"accept_unsigned: there is no message {error.args[0]}") from None
