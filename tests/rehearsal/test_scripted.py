"""Arbiters and services that follow an answers file, whatever they decorate."""

import logging
from collections.abc import Mapping, Sequence
from typing import Any, cast

import pytest

from m2pem.api.arbiter import Arbiter, ArbiterContext, BehaviorRequest, Connection, adjusts
from m2pem.api.capabilities import ArbiterCapabilities
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.service import ServiceContext, ServiceError
from m2pem.engine.records import BehaviorRequested
from m2pem.errors import PluginError
from m2pem.mission.catalogue import ResourceId
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import Answers, load_answers
from m2pem.rehearsal.scripted import ScriptedPlugins
from m2pem.telemetry.bus import Bus
from m2pem.testing.fake_arbiter import FakeArbiter

UGV1 = ResourceId("ugv1")
ANSWERS = b"""
behaviors: {Drive: [{after: 1, end: lost}, {after: 2, end: failed}]}
services: {Look: [{after: 3, write: {camera.seen: true}}, {after: 4, error: BLIND}]}
"""


class Adjusting(FakeArbiter):
    capabilities = ArbiterCapabilities(adjusts=True)

    async def adjust(self, behavior: str, epoch: int, parameters: Mapping[str, Any]) -> None:
        await self._called("adjust", behavior)


class Camera:
    """A service that somebody's plugin provides."""

    writes: Sequence[str] = ("camera.blind",)

    async def run(self, context: ServiceContext, roles: Any, properties: Any) -> Mapping[str, Any]:
        return {"camera.blind": context.service}


class Plugins(PluginManager):
    def __init__(self) -> None:
        super().__init__(block=("all",))

    def arbiter(self, name: str) -> Any:
        return Adjusting if name == "fake" else super().arbiter(name)

    def service(self, name: str) -> Any:
        return Camera if name == "Camera" else super().service(name)


def scripted(clock: VirtualClock) -> tuple[Arbiter, Answers]:
    """An arbiter that is not simulated, behind the answers."""
    answers = load_answers(ANSWERS)
    context = ArbiterContext(clock, Bus(), logging.getLogger("m2pem.arbiter"), (0.0, 0.0, 0.0))
    make = ScriptedPlugins(Plugins(), answers).arbiter("fake")
    return make({UGV1: Connection(UGV1, "ground")}, context), answers


def request(behavior: str) -> BehaviorRequest:
    return BehaviorRequest(behavior, 1, "goto", {}, (UGV1,))


def test_an_arbiter_that_is_not_simulated_starts_all_the_same_and_warns_once_for_an_element(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def main(clock: VirtualClock) -> None:
        arbiter, answers = scripted(clock)
        for number in (1, 2):
            behavior = f"r1.b{number}"
            answers.seen(
                "r1",
                [
                    BehaviorRequested(
                        1, "P", "Drive", 1, behavior, "goto", "vehicle", (UGV1,), {}, {}
                    )
                ],
            )
            await arbiter.start(request(behavior))
        await arbiter.start(request("r1.b3"))
        fake = cast("FakeArbiter", arbiter)
        assert [call.subject for call in fake.calls] == ["r1.b1", "r1.b2", "r1.b3"]

    run_virtual(main, 0)
    warnings = [each.getMessage() for each in caplog.records if each.levelno == logging.WARNING]
    assert warnings == ["answers for Drive act on simulated arbiters only"]


def test_a_decorated_arbiter_can_do_what_it_could_before() -> None:
    async def main(clock: VirtualClock) -> None:
        arbiter, _ = scripted(clock)
        assert arbiter.capabilities == Adjusting.capabilities
        assert adjusts(arbiter)
        await arbiter.adjust("r1.b1", 1, {})
        assert cast("FakeArbiter", arbiter).count("adjust", "r1.b1") == 1

    run_virtual(main, 0)


def test_a_service_waits_and_writes_or_fails_as_its_answers_say_and_is_run_after_them() -> None:
    async def main(clock: VirtualClock) -> list[tuple[float, Any]]:
        plugins = ScriptedPlugins(Plugins(), load_answers(ANSWERS))
        found: list[tuple[float, Any]] = []
        for visit in ("s1", "s2", "s3"):
            context = ServiceContext(
                clock, Bus(), logging.getLogger(), run="r1", element="Look", service=visit
            )
            service = plugins.service("Camera")()
            try:
                what: Any = (await service.run(context, {}, {}), tuple(service.writes))
            except ServiceError as error:
                what = error.code
            found.append((clock.now_us() / 1_000_000, what))
        assert plugins.ending == 0
        return found

    assert run_virtual(main, 0) == [
        (3.0, ({"camera.seen": True}, ("camera.seen",))),
        (7.0, "BLIND"),
        (7.0, ({"camera.blind": "s3"}, ("camera.blind",))),
    ]


def test_a_service_that_no_plugin_provides_is_missing_only_where_it_has_no_answer() -> None:
    async def main(clock: VirtualClock) -> None:
        service = ScriptedPlugins(Plugins(), load_answers(ANSWERS)).service("Sounder")()
        context = ServiceContext(
            clock, Bus(), logging.getLogger(), run="r1", element="Look", service="s1"
        )
        assert await service.run(context, {}, {}) == {"camera.seen": True}
        for visit in ("s2", "s3"):
            context = ServiceContext(
                clock, Bus(), logging.getLogger(), run="r1", element="Sound", service=visit
            )
            with pytest.raises(PluginError, match="Sounder"):
                await service.run(context, {}, {})

    run_virtual(main, 0)
