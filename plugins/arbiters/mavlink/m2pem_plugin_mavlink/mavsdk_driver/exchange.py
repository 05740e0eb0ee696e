"""Exchanges with a vehicle through MAVSDK.

Commands and missions are carried by MAVSDK, which has its own ways of asking again. What else there
is, is carried out message by message.
"""

import asyncio
from typing import TYPE_CHECKING, Any, TypeVar

from m2pem_plugin_mavlink.mavsdk_driver import json_fields, library, missions
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import NoAnswerError, Transaction

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.mavsdk_driver.link import MavsdkLink

T = TypeVar("T")

_ACK = message_type("COMMAND_ACK")
_COMMANDS = frozenset({message_type("COMMAND_LONG").id, message_type("COMMAND_INT").id})


async def exchange(link: "MavsdkLink", transaction: Transaction[T]) -> T:
    """Run an exchange to its end.

    Raises:
        ExchangeError: it failed.
    """
    if not link.attached:
        raise NoAnswerError(f"system {link.address.system} was not heard yet")
    carried = await missions.carried(link, transaction)
    if not carried:
        await _Run(link, transaction).to_its_end()
    return transaction.outcome()


class _Run:
    """One exchange, message by message, or with its command carried by MAVSDK."""

    def __init__(self, link: "MavsdkLink", transaction: Transaction[Any]) -> None:
        self.link = link
        self.transaction = transaction
        self._woken = asyncio.Event()
        self._command = False

    async def to_its_end(self) -> None:
        transaction = self.transaction
        transaction.begin(self.link.now_s())
        messages = transaction.outbox
        self._command = len(messages) == 1 and messages[0].TYPE.id in _COMMANDS
        command = messages[0] if self._command else None
        # Of a command MAVSDK reads the acknowledgements.
        wants = transaction.wants - {_ACK.id} if self._command else transaction.wants
        end = self.link.listen(wants, self._hear)
        try:
            self._send()
            if command is not None:
                await self._have_carried(command)
            while not transaction.done:
                await self._wait()
        finally:
            end()

    async def _have_carried(self, command: Message) -> None:
        direct = library.require("mavsdk.asyncio.plugins.mavlink_direct")
        message = direct.MavlinkMessage(command.TYPE.name, fields_json=json_fields.written(command))
        try:
            answer = await self.link.calls.make(self.link.direct.send_command(message))
        except library.failure() as error:
            self.transaction.fail(NoAnswerError(f"MAVSDK: {library.reason(error)}"))
            return
        ack = json_fields.read(_ACK, answer.fields_json)
        self._hear(ack, Address(answer.system_id, answer.component_id))

    def _hear(self, message: Message, sender: Address) -> None:
        if not self.transaction.done:
            self.transaction.receive(message, sender, self.link.now_s())
            self._send()
        self._woken.set()

    def _send(self) -> None:
        outbox, self.transaction.outbox = self.transaction.outbox, []
        if not self._command:
            for message in outbox:
                self.link.send(message)

    async def _wake_at(self, time_s: float) -> None:
        await self.link.sleep(max(0.0, time_s - self.link.now_s()))
        self._woken.set()

    async def _wait(self) -> None:
        """Until something was heard, or the exchange must go on without."""
        self._woken.clear()
        deadline_s = self.transaction.deadline_s
        if deadline_s is None:
            await self._woken.wait()
            return
        alarm = asyncio.get_running_loop().create_task(self._wake_at(deadline_s))
        try:
            await self._woken.wait()
        finally:
            alarm.cancel()
            await asyncio.wait([alarm])
        deadline_s = self.transaction.deadline_s
        if deadline_s is not None and self.link.now_s() >= deadline_s and not self.transaction.done:
            self.transaction.expire(self.link.now_s())
            self._send()
