"""A connection to an MQTT broker, made again whenever it is lost."""

import asyncio
import logging
import ssl
from collections.abc import Callable, Sequence
from pathlib import Path

import aiomqtt

from m2pem.api.latest_task import cancel_and_wait
from m2pem.errors import PluginError
from m2pem_plugin_vda5050.messages import RETAINED
from m2pem_plugin_vda5050.settings import BrokerSettings, private, read_password

RETRY_AFTER_S = 1.0
"""In real time."""

KEEPALIVE_S = 15
"""The standard's heartbeat between a client and the broker."""

WAITING = 1_000
"""Messages that wait to be sent or read. More are dropped: QoS 0 promises no more."""


def tls_context(settings: BrokerSettings) -> ssl.SSLContext | None:
    """Return how to encrypt; None: not at all.

    Raises:
        PluginError: a file cannot be used, or others may read the key.
    """
    if not settings.tls:
        return None
    try:
        context = ssl.create_default_context(cafile=settings.ca or None)
        if settings.certificate:
            private(Path(settings.key))
            context.load_cert_chain(settings.certificate, settings.key)
    except (OSError, ssl.SSLError) as error:
        file = settings.ca if settings.ca and not Path(settings.ca).is_file() else settings.url
        raise PluginError(f"{file}: TLS cannot be used: {error}") from None
    return context


class Broker:
    """A client of a broker. Its methods are for the event loop.

    `topics`: what it subscribes to. `received`: is called with the topic and the payload of each
    message; it must not raise. `connected`: is called when it is subscribed, each time. `will`: the
    last will.
    """

    def __init__(
        self,
        settings: BrokerSettings,
        identifier: str,
        topics: Sequence[tuple[str, int]],
        received: Callable[[str, bytes], None],
        connected: Callable[[], None],
        logger: logging.Logger,
        will: aiomqtt.Will | None = None,
    ) -> None:
        self._settings, self._identifier, self._topics = settings, identifier, topics
        self._received, self._connected, self._will = received, connected, will
        self._logger = logger
        self._password = read_password(settings)
        self._tls = tls_context(settings)
        self._outgoing: asyncio.Queue[tuple[str, bytes, int, bool]] | None = None
        self._task: asyncio.Task[None] | None = None
        self._problem = ""
        self.first_connected = asyncio.Event()

    @property
    def is_connected(self) -> bool:
        return self._outgoing is not None

    @property
    def problem(self) -> str:
        """Why it is not connected; "" if it is."""
        return "" if self.is_connected else self._problem or "it is not connected yet"

    def open(self) -> None:
        """Connect in the background."""
        self._task = asyncio.get_running_loop().create_task(self._run())

    async def close(self) -> None:
        """Disconnect, after what waits was sent."""
        if self._outgoing is not None:
            try:
                async with asyncio.timeout(1.0):
                    await self._outgoing.join()
            except TimeoutError:
                self._logger.warning("%s: not all messages were sent", self._settings.url)
        await cancel_and_wait(self._task)
        self._task = None

    def publish(self, topic: str, payload: bytes, qos: int = 0, retain: bool = False) -> bool:
        """Send a message soon, in the order of the calls. False: it is not connected, or too much
        waits, and the message is dropped."""
        if self._outgoing is None:
            return False
        try:
            self._outgoing.put_nowait((topic, payload, qos, retain))
        except asyncio.QueueFull:
            self._logger.error("%s: too much waits; dropped: %s", self._settings.url, topic)
            return False
        return True

    async def _run(self) -> None:
        while True:
            try:
                await self._session()
            except (aiomqtt.MqttError, OSError) as error:
                problem = str(error) or type(error).__name__
            except Exception as error:
                self._logger.exception("%s: internal error", self._settings.url)
                problem = f"internal error: {error}"
            else:
                problem = "the connection was ended"
            if problem != self._problem:
                self._logger.warning("%s: no connection: %s", self._settings.url, problem)
                self._problem = problem
            await asyncio.sleep(RETRY_AFTER_S)

    async def _session(self) -> None:
        settings = self._settings
        client = aiomqtt.Client(
            settings.host,
            settings.port,
            username=settings.user or None,
            password=self._password,
            identifier=self._identifier,
            protocol=aiomqtt.ProtocolVersion.V311,
            clean_session=True,
            keepalive=KEEPALIVE_S,
            will=self._will,
            tls_context=self._tls,
            max_queued_incoming_messages=10 * WAITING,
            logger=self._logger.getChild("mqtt"),
        )
        async with client:
            if self._topics:
                await client.subscribe(list(self._topics))
            self._outgoing = asyncio.Queue(WAITING)
            sending = asyncio.create_task(self._send(client, self._outgoing))
            try:
                if self._problem:
                    self._logger.warning("%s: connected again", settings.url)
                self._problem = ""
                self.first_connected.set()
                self._connected()
                async for message in client.messages:
                    if message.retain and message.topic.value.rpartition("/")[2] not in RETAINED:
                        continue  # of a vehicle that is gone, perhaps: it is no sign of life
                    payload = message.payload
                    self._received(
                        str(message.topic), payload if isinstance(payload, bytes) else b""
                    )
            finally:
                self._outgoing = None
                await cancel_and_wait(sending)

    async def _send(
        self, client: aiomqtt.Client, outgoing: asyncio.Queue[tuple[str, bytes, int, bool]]
    ) -> None:
        while True:
            topic, payload, qos, retain = await outgoing.get()
            try:
                await client.publish(topic, payload, qos, retain)
            except aiomqtt.MqttError as error:
                self._logger.warning("%s: not sent: %s: %s", self._settings.url, topic, error)
            finally:
                outgoing.task_done()
