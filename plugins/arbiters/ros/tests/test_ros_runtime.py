"""The runtime over real DDS, with a peer in plain rclpy in another process."""

import asyncio
import signal
import threading
import warnings
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from uuid import UUID, uuid5

import pytest
from m2pem_interfaces.action import ExecuteBehavior
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus
from m2pem_interfaces.srv import AnswerPrompt, ListRuns
from m2pem_plugin_ros.runtime import RosError, RosRuntime, RosTimeoutError, calls, own_nodes, qos
from m2pem_plugin_ros.runtime.arguments import VARIABLE
from m2pem_plugin_ros.runtime.ros_runtime import SUBSCRIPTIONS
from m2pem_plugin_ros.testing import Peer, reserved_domain
from rclpy.action import ActionClient
from rclpy.service import Service
from std_msgs.msg import String

ECHO = Path(__file__).with_name("ros_echo_peer.py")
SPACE = UUID("7a4f3c52-6d0e-5c6d-9a3b-2d8a6d7e9f10")
AMPLE_S = 40.0


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain:
        yield domain


@pytest.fixture(scope="module")
def echo(domain: int) -> Iterator[Peer]:
    with Peer(ECHO, domain) as peer:
        yield peer


@pytest.fixture
async def ros(domain: int, echo: Peer) -> AsyncIterator[RosRuntime]:
    async with RosRuntime("tested", domain_id=domain) as ros:
        yield ros


def goal(behavior: str, name: str) -> tuple[ExecuteBehavior.Goal, UUID]:
    command = BehaviorCommand(verb=BehaviorCommand.START, id=name, behavior=behavior)
    return ExecuteBehavior.Goal(command=command), uuid5(SPACE, name)


async def connected(ready: Callable[[], object]) -> None:
    while not ready():  # noqa: ASYNC110  # rclpy has no event for it
        await asyncio.sleep(0.01)


async def test_messages_come_back_in_order_on_the_loop(ros: RosRuntime) -> None:
    heard: asyncio.Queue[tuple[str, int]] = asyncio.Queue()
    ros.subscribe(
        String, "pong", lambda m: heard.put_nowait((m.data, threading.get_ident())), qos.EVENTS
    )
    ping = ros.node.create_publisher(String, "ping", qos.EVENTS)
    await connected(ping.get_subscription_count)
    await connected(lambda: ros.node.count_publishers("pong"))
    words = [f"{n}" for n in range(300)]
    for word in words:
        ping.publish(String(data=word))
    async with asyncio.timeout(AMPLE_S):
        came = [await heard.get() for _ in words]
    assert came == [(word, threading.get_ident()) for word in words]


async def test_who_subscribes_late_hears_what_is_latched(ros: RosRuntime) -> None:
    heard: asyncio.Queue[String] = asyncio.Queue()
    ros.subscribe(String, "greeting", heard.put_nowait, qos.STATUS)
    async with asyncio.timeout(AMPLE_S):
        assert (await heard.get()).data == "hello"


async def test_a_callback_that_raises_gets_the_next_message(
    ros: RosRuntime, caplog: pytest.LogCaptureFixture
) -> None:
    heard: asyncio.Queue[str] = asyncio.Queue()

    def hear(message: String) -> None:
        if message.data == "bad":
            raise ValueError(message.data)
        heard.put_nowait(message.data)

    ros.subscribe(String, "own", hear, qos.EVENTS)
    own = ros.node.create_publisher(String, "own", qos.EVENTS)
    await connected(own.get_subscription_count)
    for word in ("bad", "good"):
        own.publish(String(data=word))
    async with asyncio.timeout(AMPLE_S):
        assert await heard.get() == "good"
    assert "a callback for a ROS message failed" in caplog.text


async def test_of_200_calls_at_once_each_gets_its_own_answer(ros: RosRuntime) -> None:
    # The peer's service keeps ten requests, as services do by default.
    client = ros.client(AnswerPrompt, "answer")
    requests = [AnswerPrompt.Request(prompt=f"p{n}", decision="go") for n in range(200)]
    answers = await asyncio.gather(*(ros.call(client, r, AMPLE_S) for r in requests))
    assert [a.message for a in answers] == [f"p{n}: go" for n in range(200)]


async def test_a_service_that_nobody_offers_times_out(ros: RosRuntime) -> None:
    client = ros.client(ListRuns, "nobody")
    with pytest.raises(RosTimeoutError, match=r"nobody: no server was found within 0\.05 s"):
        await ros.call(client, ListRuns.Request(), 0.05)


async def test_a_call_that_is_not_answered_times_out_and_the_next_is_answered(
    ros: RosRuntime,
) -> None:
    never = asyncio.Event()

    async def serve(request: ListRuns.Request, response: ListRuns.Response) -> ListRuns.Response:
        if request.open_only:
            await never.wait()
        response.success = True
        return response

    ros.serve(ListRuns, "runs", serve)
    client = ros.client(ListRuns, "runs")
    assert (await ros.call(client, ListRuns.Request(), AMPLE_S)).success
    unanswered = (ros.call(client, ListRuns.Request(open_only=True), 0.3) for _ in range(20))
    outcomes = await asyncio.gather(*unanswered, return_exceptions=True)
    assert all(isinstance(outcome, RosTimeoutError) for outcome in outcomes)
    assert "no answer came within 0.3 s" in str(outcomes[0])
    assert (await ros.call(client, ListRuns.Request(), AMPLE_S)).success


async def test_handlers_of_a_service_run_side_by_side(ros: RosRuntime) -> None:
    both = asyncio.Barrier(2)

    async def serve(_: ListRuns.Request, response: ListRuns.Response) -> ListRuns.Response:
        await both.wait()
        return response

    ros.serve(ListRuns, "together", serve)
    client = ros.client(ListRuns, "together")
    await asyncio.gather(*(ros.call(client, ListRuns.Request(), AMPLE_S) for _ in range(2)))


async def test_a_handler_that_raises_answers_with_its_error(
    ros: RosRuntime, caplog: pytest.LogCaptureFixture
) -> None:
    async def serve(_: ListRuns.Request, __: ListRuns.Response) -> ListRuns.Response:
        raise ValueError("out of paper")

    ros.serve(ListRuns, "broken", serve)
    answer = await ros.call(ros.client(ListRuns, "broken"), ListRuns.Request(), AMPLE_S)
    assert not answer.success
    assert "out of paper" in answer.message
    assert "service broken failed" in caplog.text


def drop_responses(monkeypatch: pytest.MonkeyPatch, times: int) -> None:
    """What rclpy does while DDS has not discovered who asked."""
    send = Service.send_response
    left = [times]

    def dropped(service: Service, response: object, header: object) -> None:
        if left[0] == 0:
            send(service, response, header)
            return
        left[0] -= 1
        warnings.warn("failed to send response (timeout): no client", RuntimeWarning, stacklevel=1)

    monkeypatch.setattr(Service, "send_response", dropped)


async def test_a_response_is_sent_again_until_its_client_is_discovered(
    ros: RosRuntime, monkeypatch: pytest.MonkeyPatch
) -> None:
    handled = []

    async def serve(request: ListRuns.Request, response: ListRuns.Response) -> ListRuns.Response:
        handled.append(request)
        response.message = "at last"
        return response

    drop_responses(monkeypatch, 3)
    ros.serve(ListRuns, "late", serve)
    answer = await ros.call(ros.client(ListRuns, "late"), ListRuns.Request(), AMPLE_S)
    assert answer.message == "at last"
    assert len(handled) == 1


async def test_a_response_that_can_never_be_sent_is_reported(
    ros: RosRuntime, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def serve(_: ListRuns.Request, response: ListRuns.Response) -> ListRuns.Response:
        return response

    monkeypatch.setattr(calls, "AGAIN_S", (0.01, 0.01))
    drop_responses(monkeypatch, -1)
    ros.serve(ListRuns, "gone", serve)
    call = asyncio.create_task(ros.call(ros.client(ListRuns, "gone"), ListRuns.Request(), AMPLE_S))
    await connected(lambda: "service gone: DDS has not discovered the client" in caplog.text)
    call.cancel()


async def test_a_goal_is_accepted_fed_back_and_succeeds(ros: RosRuntime) -> None:
    client = ActionClient(ros.node, ExecuteBehavior, "execute_behavior")
    fed_back: list[int] = []
    told = goal("goto", "r1.b1")
    handle = await ros.send_goal(
        client,
        told[0],
        AMPLE_S,
        goal_id=told[1],
        feedback=lambda message: fed_back.append(message.feedback.status.state),
    )
    assert handle.accepted
    outcome = await ros.wait(handle.get_result_async(), AMPLE_S)
    assert outcome.result.status.state == BehaviorStatus.SUCCEEDED
    assert outcome.result.status.id == "r1.b1"
    async with asyncio.timeout(AMPLE_S):
        await connected(lambda: fed_back)
    assert fed_back == [BehaviorStatus.RUNNING]


async def test_a_goal_is_cancelled(ros: RosRuntime) -> None:
    client = ActionClient(ros.node, ExecuteBehavior, "execute_behavior")
    told = goal("wait", "r1.b2")
    handle = await ros.send_goal(client, told[0], AMPLE_S, goal_id=told[1])
    result = handle.get_result_async()
    with pytest.raises(RosTimeoutError, match=r"no answer came within 0\.05 s"):
        await ros.wait(handle.get_result_async(), 0.05)
    await ros.wait(handle.cancel_goal_async(), AMPLE_S)
    outcome = await ros.wait(result, AMPLE_S)
    assert outcome.result.status.state == BehaviorStatus.CANCELLED


async def test_closing_ends_the_calls_that_wait(ros: RosRuntime) -> None:
    client = ros.client(ListRuns, "nobody")
    call = asyncio.create_task(ros.call(client, ListRuns.Request(), AMPLE_S))
    await asyncio.sleep(0)
    await ros.close()
    with pytest.raises(RosError, match="was closed"):
        await call


async def test_signals_stay_with_the_program(domain: int) -> None:
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    async with RosRuntime("tested", domain_id=domain):
        during = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    assert during == before


async def test_a_bad_name_is_refused(domain: int) -> None:
    with pytest.raises(RosError, match="the node '/no such name' cannot be created"):
        RosRuntime("no such name", domain_id=domain)


def test_security_without_keys_is_refused(
    domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path))

    async def start() -> None:
        RosRuntime("secret", domain_id=domain)

    with pytest.raises(RosError, match="ROS_SECURITY_ENABLE asks for DDS security"):
        asyncio.run(start())


def resources() -> tuple[int, int]:
    """Threads, and open sockets, of this process."""
    sockets = 0
    for descriptor in Path("/proc/self/fd").iterdir():
        try:
            sockets += str(descriptor.readlink()).startswith("socket:")
        except FileNotFoundError:  # that of this listing
            continue
    return len(list(Path("/proc/self/task").iterdir())), sockets


async def test_many_subscriptions_have_threads_of_their_own(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, "--ros-args -r __node:=renamed -r __ns:=/fleet")
    count = 2 * SUBSCRIPTIONS + 1
    received: asyncio.Queue[tuple[int, str]] = asyncio.Queue()
    async with RosRuntime("many", domain_id=domain, spreads=True) as ros:
        for number in range(count):

            def take(message: String, number: int = number) -> None:
                received.put_nowait((number, message.data))

            ros.subscribe(String, f"word{number}", take, qos.EVENTS)
        assert set(ros.node_names) == {"/fleet/renamed", "/fleet/_many_1", "/fleet/_many_2"}
        assert own_nodes() >= set(ros.node_names)
        publishers = [ros.publisher(String, f"word{number}", qos.EVENTS) for number in range(count)]
        for number, publisher in enumerate(publishers):
            await connected(publisher.get_subscription_count)
            publisher.publish(String(data=f"{number}"))
        async with asyncio.timeout(AMPLE_S):
            came = {await received.get() for _ in publishers}
    assert came == {(number, f"{number}") for number in range(count)}
    assert not [each.name for each in threading.enumerate() if "many" in each.name]


async def test_closing_leaves_no_thread_and_no_socket(domain: int, echo: Peer) -> None:
    async def live_and_close() -> None:
        async with RosRuntime("brief", domain_id=domain) as ros:
            client = ros.client(AnswerPrompt, "answer")
            await ros.call(client, AnswerPrompt.Request(), AMPLE_S)
            ActionClient(ros.node, ExecuteBehavior, "execute_behavior")
            ros.subscribe(String, "pong", lambda _: None, qos.EVENTS)

    await live_and_close()  # also starts the thread of asyncio.to_thread, which stays
    before = resources()
    await live_and_close()
    async with asyncio.timeout(AMPLE_S):  # what has ended may be listed for a moment
        await connected(
            lambda: all(now <= was for now, was in zip(resources(), before, strict=True))
        )
