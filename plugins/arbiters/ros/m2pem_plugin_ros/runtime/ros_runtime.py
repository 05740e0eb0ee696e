"""rclpy within an asyncio program: threads that receive, all else on the event loop."""

import asyncio
import logging
import os
from collections import deque
from collections.abc import Awaitable, Callable, Collection, Coroutine, Sequence
from typing import Any, Generic, Self, TypeVar
from uuid import UUID
from weakref import WeakSet

import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from unique_identifier_msgs import msg as unique_identifier

from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.runtime import qos as qualities
from m2pem_plugin_ros.runtime.arguments import process_arguments, refused
from m2pem_plugin_ros.runtime.calls import Calls, Responses
from m2pem_plugin_ros.runtime.executor_thread import ExecutorThread

WAITING = 1000


SUBSCRIPTIONS = 40
"""How many subscriptions share a thread, of a runtime with several. For each message, rclpy looks
twice at every entity of the executor."""

SILENT = ("--ros-args", "--disable-stdout-logs", "--")
"""The console belongs to m2pem; what is logged with ROS is on /rosout."""

logger = logging.getLogger(__name__)


_live: "WeakSet[RosRuntime]" = WeakSet()


def own_nodes() -> frozenset[str]:
    """Return the full names of the nodes of this process."""
    return frozenset(name for runtime in _live for name in runtime.node_names)


class RosRuntime:
    """A connection to ROS with its own context. It changes no global state and handles no signals.

    It belongs to the running event loop on which it was made. Callbacks of ROS run on that loop;
    publishing and creating entities is done from it directly. `async with` closes it.

    `domain_id` None takes ROS_DOMAIN_ID. `arguments` are those of ROS, such as `["--ros-args",
    "--remap", "a:=b"]`; those of the process (runtime/arguments.py) come before them. `kind` is the
    class of the first node, and `options` are its keywords. `console`: what is logged with ROS is
    printed at standard error, too. `spreads`: many subscriptions are expected; beyond the first
    SUBSCRIPTIONS, each so many get a hidden node and a thread of their own.

    Raises:
        RosError: ROS cannot be started like that, for example with DDS security and no keys.
    """

    def __init__(
        self,
        name: str,
        *,
        namespace: str = "",
        domain_id: int | None = None,
        arguments: Sequence[str] = (),
        kind: Callable[..., Node] = Node,
        console: bool = False,
        spreads: bool = False,
        **options: Any,
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._calls = Calls(self._loop)
        self._nodes: dict[Node, str] = {}
        """With their full names."""
        self._tasks: set[asyncio.Task[Any]] = set()
        self._closing: asyncio.Task[None] | None = None
        self.context = Context()
        try:
            rclpy.init(
                context=self.context,
                domain_id=domain_id,
                args=[
                    *([] if console else SILENT),
                    *process_arguments(),
                    *arguments,
                ],
                signal_handler_options=SignalHandlerOptions.NO,
            )
        except Exception as error:  # rclpy has no base class for what it raises
            raise RosError(f"ROS cannot be started: {refused(error)}{_security()}") from error
        self._name, self._spreads = name, spreads
        first = ExecutorThread(self.context, name, lambda: self._closing is not None)
        self._threads = [first]
        self.executor = first.executor
        self._subscriptions = 0
        """Those without a node of their caller."""
        try:
            self.node = self.make_node(name, namespace, kind=kind, **options)
        except RosError:
            self._let_go()
            raise
        self._subscriber = self.node
        first.start()
        _live.add(self)

    @property
    def node_names(self) -> Sequence[str]:
        """The full names of its nodes."""
        return list(self._nodes.values())

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    # --- nodes and topics -----------------------------------------------------------------------

    def make_node(
        self, name: str, namespace: str = "", *, kind: Callable[..., Node] = Node, **options: Any
    ) -> Node:
        """Make another node of the same connection. Options are those of `rclpy.node.Node`.

        Raises:
            RosError: the name is not valid in ROS, or DDS refuses.
        """
        return self._add_node(self.executor, name, namespace, kind, **options)

    def _add_node(
        self,
        executor: Executor,
        name: str,
        namespace: str = "",
        kind: Callable[..., Node] = Node,
        **options: Any,
    ) -> Node:
        try:
            node = kind(name, context=self.context, namespace=namespace, **options)
        except Exception as error:  # rclpy has no base class for what it raises
            what = f"the node '{namespace}/{name}' cannot be created"
            raise RosError(f"{what}: {refused(error)}{_security()}") from error
        executor.add_node(node)
        self._nodes[node] = node.get_fully_qualified_name()
        return node

    def drop_node(self, node: Node) -> None:
        """Destroy a node that `make_node` made, and all that belongs to it."""
        self.executor.remove_node(node)
        del self._nodes[node]
        _destroy(node)

    def entities(self, node: Node | None = None) -> frozenset[Any]:
        """Return all that a node has now, for `destroy_since`."""
        one = node or self.node
        kinds = (one.publishers, one.subscriptions, one.clients, one.services, one.waitables)
        return frozenset(entity for kind in kinds for entity in kind)

    def destroy_since(self, before: Collection[Any], node: Node | None = None) -> None:
        """Destroy all that a node has got since `entities` returned `before`."""
        one = node or self.node
        for waitable in list(one.waitables):
            if waitable not in before and isinstance(waitable, ActionClient | ActionServer):
                waitable.destroy()
        for entities, destroy in (
            (one.publishers, one.destroy_publisher),
            (one.subscriptions, one.destroy_subscription),
            (one.clients, one.destroy_client),
            (one.services, one.destroy_service),
        ):
            for entity in [each for each in entities if each not in before]:
                destroy(entity)

    def stamp_us(self, time_us: int) -> int:
        """Return the time for the header of a message: that of /clock with `use_sim_time`, else
        `time_us`. Microseconds since the Unix epoch."""
        if not self.uses_sim_time:
            return time_us
        return int(self.node.get_clock().now().nanoseconds) // 1000

    @property
    def uses_sim_time(self) -> bool:
        """Whether the time of the first node is that of /clock."""
        return bool(self.node.get_clock().ros_time_is_active)

    def publisher(self, message_type: Any, topic: str, qos: QoSProfile) -> Any:
        """A publisher of the first node."""
        return self.node.create_publisher(
            message_type, topic, qos, event_callbacks=qualities.NO_PUBLISHER_EVENTS
        )

    def subscribe(
        self,
        message_type: Any,
        topic: str,
        callback: Callable[[Any], None],
        qos: QoSProfile,
        *,
        node: Node | None = None,
        waiting: int = WAITING,
    ) -> Any:
        """Subscribe with a callback on the loop. Of more than `waiting` messages, the oldest are
        dropped."""
        inbox = Inbox(self._loop, callback, waiting)
        return (node or self._next_subscriber()).create_subscription(
            message_type, topic, inbox.put, qos, event_callbacks=qualities.NO_SUBSCRIPTION_EVENTS
        )

    def _next_subscriber(self) -> Node:
        """Return the node of the next subscription."""
        if self._spreads and self._subscriptions and self._subscriptions % SUBSCRIPTIONS == 0:
            name = f"_{self._name}_{self._subscriptions // SUBSCRIPTIONS}"
            thread = ExecutorThread(self.context, name, lambda: self._closing is not None)
            self._threads.append(thread)
            # Its own arguments, as those of the process may rename every node, and have each
            # subscribe to /clock.
            self._subscriber = self._add_node(
                thread.executor,
                name,
                cli_args=["--ros-args", "-r", f"__node:={name}", "-p", "use_sim_time:=false"],
                enable_rosout=False,
                start_parameter_services=False,
            )
            thread.start()
        self._subscriptions += 1
        return self._subscriber

    # --- services and actions that others offer -------------------------------------------------

    def client(self, service_type: Any, name: str, *, node: Node | None = None) -> Any:
        """A client for `call`, which keeps to the bound of calls in flight."""
        create = (node or self.node).create_client
        return create(service_type, name, qos_profile=qualities.SERVICES)

    async def call(self, client: Any, request: Any, timeout_s: float) -> Any:
        """Call a service, which may not be there yet, and return its response.

        Raises:
            RosTimeoutError: no answer within `timeout_s`, counted from now.
        """
        what = f"service {client.srv_name}"
        return await self._calls.ask(
            client, client.service_is_ready, lambda: client.call_async(request), timeout_s, what
        )

    async def send_goal(
        self,
        client: Any,
        goal: Any,
        timeout_s: float,
        *,
        goal_id: UUID,
        feedback: Callable[[Any], None] | None = None,
    ) -> Any:
        """Send a goal to an action server, and return its handle; `accepted` says whether it was
        accepted.

        `feedback` gets the feedback messages, on the loop.

        Raises:
            RosTimeoutError: no answer within `timeout_s`, counted from now.
        """
        uuid = unique_identifier.UUID(uuid=list(goal_id.bytes))
        hear = Inbox(self._loop, feedback, WAITING).put if feedback is not None else None
        what = f"goal {goal_id}"
        return await self._calls.ask(
            client,
            client.server_is_ready,
            lambda: client.send_goal_async(goal, feedback_callback=hear, goal_uuid=uuid),
            timeout_s,
            what,
        )

    async def wait(self, future: Any, timeout_s: float | None = None) -> Any:
        """Return the result of a future of rclpy, such as `handle.get_result_async()`.

        Raises:
            RosTimeoutError: it did not come within `timeout_s`.
        """
        return await self._calls.wait(future, "ROS", timeout_s)

    # --- services and actions that we offer -----------------------------------------------------

    def serve(
        self,
        service_type: Any,
        name: str,
        handler: Callable[[Any, Any], Awaitable[Any]],
        *,
        node: Node | None = None,
    ) -> Any:
        """Serve a service. `handler(request, response)` is a coroutine function on the loop.

        Several requests are handled at once. If a handler raises, the error is logged, and an empty
        response is sent, with the error in its `message` if it has one.
        """

        async def answer(request: Any, response: Any) -> Any:
            try:
                return await handler(request, response)
            except Exception as error:
                logger.exception("service %s failed", name)
                empty = service_type.Response()
                if hasattr(empty, "message"):
                    empty.message = f"internal error: {error!r}"
                return empty

        service = (node or self.node).create_service(
            service_type,
            name,
            self.coroutine(answer),
            qos_profile=qualities.SERVICES,
            callback_group=ReentrantCallbackGroup(),
        )
        # The executor sends with the service's method, and has no other place for this.
        service.send_response = Responses(service, self.executor, self._loop).send
        return service

    def coroutine(
        self, handler: Callable[..., Coroutine[Any, Any, Any]]
    ) -> Callable[..., Coroutine[Any, Any, Any]]:
        """Make a callback for rclpy of a coroutine function that runs on the loop.

        It is for callbacks that return an answer: services, and `execute_callback` of an action
        server. Their entity needs a ReentrantCallbackGroup, or one call waits for the other.
        """

        async def callback(*arguments: Any) -> Any:
            answer = rclpy.Future(executor=self.executor)
            self._loop.call_soon_threadsafe(self._run, handler, arguments, answer)
            return await answer

        return callback

    def _run(
        self,
        handler: Callable[..., Coroutine[Any, Any, Any]],
        arguments: tuple[Any, ...],
        answer: Any,
    ) -> None:
        task = self._loop.create_task(handler(*arguments))
        self._tasks.add(task)
        task.add_done_callback(lambda done: self._hand_back(done, answer))

    def _hand_back(self, task: asyncio.Task[Any], answer: Any) -> None:
        self._tasks.discard(task)
        if task.cancelled():  # the runtime closes: the client gets no answer
            return
        if (error := task.exception()) is not None:
            answer.set_exception(error)
        else:
            answer.set_result(task.result())
        if self.context.ok():
            self.executor.wake()  # a result alone does not wake an executor that waits

    # --- the thread, and its end ----------------------------------------------------------------

    async def close(self) -> None:
        """Close the connection. It may be called again."""
        if self._closing is None:
            self._closing = self._loop.create_task(self._close())
        await asyncio.shield(self._closing)

    async def _close(self) -> None:
        self._calls.close()
        await cancel_and_wait(*self._tasks)
        # End the threads first: they may wait for entities that are destroyed below.
        rclpy.try_shutdown(context=self.context)
        for thread in self._threads:
            await asyncio.to_thread(thread.join)
        # In a thread, too: it takes milliseconds for each entity.
        await asyncio.to_thread(self._let_go)

    def _let_go(self) -> None:
        for node in list(self._nodes):
            _destroy(node)
        self._nodes.clear()
        for thread in self._threads:
            thread.executor.shutdown(timeout_sec=0)
        rclpy.try_shutdown(context=self.context)
        self.context.destroy()


def _destroy(node: Node) -> None:
    for waitable in list(node.waitables):
        if isinstance(waitable, ActionClient | ActionServer):  # nodes forget about these
            waitable.destroy()
    node.destroy_node()


def _security() -> str:
    """Return a hint about DDS security if it is enabled, else ""."""
    if os.environ.get("ROS_SECURITY_ENABLE", "").lower() != "true":
        return ""
    return (
        "; ROS_SECURITY_ENABLE asks for DDS security: it needs keys (ROS_SECURITY_KEYSTORE), and a "
        "ROS that is built with it, which the wheels are not; or keep others off the network"
    )


T = TypeVar("T")

BATCH = 100
"""Messages that are handled before other tasks of the loop run."""


class Inbox(Generic[T]):
    """Passes each item to a callback on the loop. If the callback is too slow, the oldest are
    dropped.

    The loop is woken once for all waiting items. An error of the callback is logged.
    """

    def __init__(
        self, loop: asyncio.AbstractEventLoop, callback: Callable[[T], None], size: int
    ) -> None:
        self._loop = loop
        self._callback = callback
        self._items: deque[T] = deque(maxlen=size)
        self._drains = False

    def put(self, item: T) -> None:
        """Add an item. It may be called in any thread."""
        self._items.append(item)
        if not self._drains:
            self._drains = True
            try:
                self._loop.call_soon_threadsafe(self._drain)
            except RuntimeError:  # the loop is closed, and no task reads
                self._items.clear()

    def _drain(self) -> None:
        # First, so that an item that comes while the last one is handled wakes the loop again.
        self._drains = False
        for _ in range(BATCH):
            try:
                item = self._items.popleft()
            except IndexError:
                return
            try:
                self._callback(item)
            except Exception:
                logger.exception("a callback for a ROS message failed")
        if not self._drains:
            self._drains = True
            self._loop.call_soon(self._drain)
