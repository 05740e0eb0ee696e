"""The contract of services, as tests to inherit."""

import asyncio
import logging
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import msgspec
import pytest

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.service import Service, ServiceContext, ServiceError
from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value
from m2pem.telemetry.bus import Bus
from m2pem.testing.contracts.contract import Contract

START_US = 1_767_225_600_000_000  # 2026-01-01T00:00:00Z
KEY = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")


@dataclass(frozen=True, slots=True)
class ServiceCase:
    """A situation in which the service ends, well or with a `ServiceError`.

    `published`: states of vehicles and payloads, each with the seconds after the one before (the
    first: after the service started). `within_s`: virtual seconds that it may take after the last.
    """

    roles: Mapping[str, ResourceId] = field(default_factory=dict)
    properties: Mapping[str, Value] = field(default_factory=dict)
    detectors: tuple[ResourceId, ...] = ()
    published: Sequence[tuple[float, VehicleState | PayloadState]] = ()
    within_s: float = 3600.0


class ServiceContract(Contract):
    """Override `service` and `case`; more tests of your own may use `run_case`."""

    m2pem_contract: ClassVar[str] = "ServiceContract"

    @pytest.fixture
    def service(self) -> Service:
        """A new service, as the executive makes one for each task."""
        raise NotImplementedError("override the fixture `service`")

    @pytest.fixture
    def case(self) -> ServiceCase:
        """A situation in which it ends."""
        raise NotImplementedError("override the fixture `case`")

    def test_declares_the_dotted_names_that_it_writes(self, service: Service) -> None:
        """`writes` is a sequence of names; `m2pem check` trusts it."""
        assert not isinstance(service.writes, str), "`writes` is a sequence of texts, not one text"
        wrong = [name for name in service.writes if not KEY.fullmatch(name)]
        assert not wrong, f"not dotted names: {wrong}"
        assert len(set(service.writes)) == len(service.writes), "a name is declared twice"

    def test_writes_only_what_it_declared(self, service: Service, case: ServiceCase) -> None:
        """A service returns a map of declared names to values that the data store can hold."""
        result = run_case(service, case)
        if isinstance(result, ServiceError):
            return
        assert isinstance(result, Mapping), f"it returned {result!r}, not a map"
        undeclared = {
            name
            for key, value in result.items()
            for name in _written(key, value)
            if not _declared(name, service.writes)
        }
        assert not undeclared, f"written but not in `writes`: {sorted(undeclared)}"
        kept = msgspec.json.decode(msgspec.json.encode(result))
        assert kept == result, "the data store holds only JSON values"

    def test_an_error_has_texts_for_the_mission_to_catch(
        self, service: Service, case: ServiceCase
    ) -> None:
        """A `ServiceError` has a code, not empty, and a reason for people."""
        result = run_case(service, case)
        if isinstance(result, ServiceError):
            assert isinstance(result.code, str), "the code is a text"
            assert result.code.strip(), "the code is not empty"
            assert isinstance(result.reason, str), "the reason is a text"

    def test_ends_when_it_is_cancelled(self, service: Service, case: ServiceCase) -> None:
        """An interrupted task cancels its service, which must not swallow that."""

        async def main(clock: VirtualClock) -> None:
            running = asyncio.create_task(_run(service, case, clock, Bus()))
            for _ in range(3):
                await asyncio.sleep(0)
            if running.done():
                return
            running.cancel()
            await asyncio.wait([running], timeout=60)
            assert running.done(), "it went on for a minute after it was cancelled"
            if not running.cancelled():
                outcome = running.exception() or running.result()
                raise AssertionError(f"cancelled, it ended with {outcome!r}, as if it were not")

        run_virtual(main, START_US)


def run_case(service: Service, case: ServiceCase) -> Mapping[str, Value] | ServiceError:
    """Run a service through a case in virtual time; return what it wrote, or its error.

    Raises:
        AssertionError: it did not end, or raised an error that no mission can catch.
    """

    async def main(clock: VirtualClock) -> Mapping[str, Value] | ServiceError:
        bus = Bus()
        running = asyncio.create_task(_run(service, case, clock, bus))
        await asyncio.sleep(0)
        for after_s, state in case.published:
            await clock.sleep(after_s)
            bus.publish(state)
        await asyncio.wait([running], timeout=case.within_s)
        assert running.done(), f"it had not ended {case.within_s} s after the last state"
        error = running.exception()
        if isinstance(error, ServiceError):
            return error
        assert error is None, f"it raised {error!r}; an error for the mission is a ServiceError"
        return running.result()

    return run_virtual(main, START_US)


async def _run(
    service: Service, case: ServiceCase, clock: VirtualClock, bus: Bus
) -> Mapping[str, Value]:
    context = ServiceContext(clock, bus, logging.getLogger("m2pem.service"), case.detectors)
    return await service.run(context, case.roles, case.properties)


def _written(key: str, value: Value) -> list[str]:
    """Return the names under which a value is stored: a map is stored entry by entry."""
    if not isinstance(value, dict):
        return [key]
    return [name for part, inner in value.items() for name in _written(f"{key}.{part}", inner)]


def _declared(name: str, writes: Sequence[str]) -> bool:
    return any(name == declared or name.startswith(f"{declared}.") for declared in writes)
