"""What missions throw, as publications and calls of services."""

import asyncio
import logging
from collections.abc import Mapping, Sequence
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from m2pem.api import Fields, MissionControl, RunId, ThrownEvents
from m2pem.errors import M2pemError, OperatorError
from m2pem_plugin_ros.face.event_settings import CalledService, SentTopic
from m2pem_plugin_ros.face.goals import ended
from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.interfaces.fill_fields import fill
from m2pem_plugin_ros.interfaces.messages import time_of
from m2pem_plugin_ros.interfaces.plain_values import MessageFields
from m2pem_plugin_ros.interfaces.texts import one_line
from m2pem_plugin_ros.runtime import RosRuntime, qos

DISCOVERY_S = 3.0
"""A subscriber may need that to be found, after the face has begun."""
LOOK_EVERY_S = 0.02
NOT_LATCHED = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
MOST_CALLS = 100
"""Calls that wait for an answer."""
LONGEST = 300
HEADER = "std_msgs/Header"

log = logging.getLogger("m2pem.face.events")


class SentEvents:
    """Publishes and calls until `run` is cancelled."""

    def __init__(
        self,
        ros: RosRuntime,
        control: MissionControl,
        sent: Sequence[SentTopic | CalledService],
        thrown: ThrownEvents,
    ) -> None:
        self._ros = ros
        self._node = ros.node
        self._control = control
        self._sent = {each.rule: each for each in sent}
        self._thrown = thrown
        self._loop = asyncio.get_running_loop()
        self._begun_s = self._loop.time()
        self._publishers: dict[tuple[str, str, bool], Any] = {}
        self._clients: dict[tuple[str, str], Any] = {}
        self._calls: set[asyncio.Task[None]] = set()
        for each in sent:
            if isinstance(each, SentTopic):
                key = _key(each)
                if key not in self._publishers:
                    quality = qos.STATUS if each.latched else NOT_LATCHED
                    made = self._node.create_publisher(each.type, each.topic, quality)
                    self._publishers[key] = made
            elif (each.service, each.type_name) not in self._clients:
                made = ros.client(each.type, each.service)
                self._clients[each.service, each.type_name] = made

    async def run(self) -> None:
        """Send what is thrown, in its order."""
        try:
            async for rule, run, data in self._thrown:
                sent = self._sent[rule]
                try:
                    if isinstance(sent, SentTopic):
                        await self._publish(sent, run, data)
                    else:
                        self._begin_call(sent, run, data)
                except M2pemError as error:
                    _report(sent, run, str(error))
                except Exception as error:
                    log.exception("%s", sent.key)
                    _report(sent, run, repr(error))
        finally:
            for task in self._calls.copy():
                await ended(task)

    async def _publish(self, sent: SentTopic, run: RunId, data: Fields) -> None:
        message = self._filled(sent, sent.type, data)
        publisher = self._publishers[_key(sent)]
        until_s = self._begun_s + DISCOVERY_S
        while not publisher.get_subscription_count() and self._loop.time() < until_s:  # noqa: ASYNC110
            await asyncio.sleep(LOOK_EVERY_S)
        if not publisher.get_subscription_count():
            log.warning("%s", self._unserved(sent, publisher.topic_name, run))
        publisher.publish(message)

    def _unserved(self, sent: SentTopic, topic: str, run: RunId) -> str:
        """Return that nobody receives what is published, and why."""
        found = self._node.get_subscriptions_info_by_topic(topic)
        text = f"{sent.key}: {sent.rule.thrown} of run {run}: no node subscribes to {topic}"
        if not found:
            return text
        kinds = ", ".join(sorted({each.topic_type for each in found}))
        return f"{text} as {sent.type_name}; it is subscribed to as {one_line(kinds)[:LONGEST]}"

    def _begin_call(self, sent: CalledService, run: RunId, data: Fields) -> None:
        if len(self._calls) >= MOST_CALLS:
            raise OperatorError(f"{MOST_CALLS} calls of services wait for answers already")
        task = self._loop.create_task(self._call(sent, run, data))
        self._calls.add(task)
        task.add_done_callback(self._calls.discard)

    async def _call(self, sent: CalledService, run: RunId, data: Fields) -> None:
        client = self._clients[sent.service, sent.type_name]
        answer: MessageFields | None = None
        try:
            request = self._filled(sent, sent.type.Request, data)
            response = await self._ros.call(client, request, sent.timeout_s)
            answer, problem = MessageFields(response), _said(response)
        except RosError as error:
            problem = f"{error}{self._other_type(sent, client.srv_name)}"
        except M2pemError as error:
            problem = f"{sent.key}: {one_line(str(error))[:LONGEST]}"
        await sent.answer.throw(self._control, run, answer, f"ros {client.srv_name}", problem)

    def _other_type(self, sent: CalledService, name: str) -> str:
        """Return of which other types a service is, for its clients and servers."""
        known = dict(self._node.get_service_names_and_types()).get(name, [])
        others = ", ".join(sorted(set(known) - {sent.type_name}))
        if not others:
            return ""
        return f"; other nodes know it as {others}, and {sent.key} says {sent.type_name}"

    def _filled(self, sent: SentTopic | CalledService, kind: Any, data: Fields) -> Any:
        fields = sent.rule.filled(data)
        message = fill(kind, fields)
        header = fields.get("header", {})
        if kind.get_fields_and_field_types().get("header") == HEADER and (
            isinstance(header, Mapping) and "stamp" not in header
        ):
            message.header.stamp = time_of(self._node.get_clock().now().nanoseconds // 1000)
        return message


def _key(sent: SentTopic) -> tuple[str, str, bool]:
    return sent.topic, sent.type_name, sent.latched


def _said(response: Any) -> str:
    """Return the text of a response, for operators."""
    text = getattr(response, "message", "")
    said = one_line(text[:LONGEST]) if isinstance(text, str) else ""
    return f"it says: {said}" if said else "its answer is no success"


def _report(sent: SentTopic | CalledService, run: RunId, problem: str) -> None:
    log.warning(
        "%s: %s of run %s is not sent: %s",
        sent.key,
        sent.rule.thrown,
        run,
        one_line(problem)[:LONGEST],
    )
