"""The contract must find what is wrong with a service, or it proves nothing of a good one."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import cast

import pytest

from m2pem.api.service import Service, ServiceContext, ServiceError
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value
from m2pem.testing.contracts.service import ServiceCase, ServiceContract

CASE = ServiceCase()
CONTRACT = ServiceContract()


class Odd:
    """A service that writes `result`, or does what `act` does."""

    def __init__(
        self,
        writes: Sequence[str] = ("a.b",),
        result: object = None,
        act: Callable[[], Awaitable[None]] | None = None,
    ) -> None:
        self.writes = writes
        self._result = {} if result is None else result
        self._act = act

    async def run(
        self,
        context: ServiceContext,
        roles: Mapping[str, ResourceId],
        properties: Mapping[str, Value],
    ) -> Mapping[str, Value]:
        if self._act is not None:
            await self._act()
        return cast("Mapping[str, Value]", self._result)


async def swallow_cancellation() -> None:
    try:
        await asyncio.sleep(10)
    except asyncio.CancelledError:
        await asyncio.sleep(1000)


async def never_end() -> None:
    await asyncio.Event().wait()


def raising(error: Exception) -> Callable[[], Awaitable[None]]:
    async def act() -> None:
        raise error

    return act


@pytest.mark.parametrize("writes", ["a.b", ("a..b",), ("",), ("a", "a")])
def test_names_that_are_no_dotted_names_are_found(writes: Sequence[str]) -> None:
    with pytest.raises(AssertionError):
        CONTRACT.test_declares_the_dotted_names_that_it_writes(Odd(writes))


@pytest.mark.parametrize(
    "result",
    [{"a.c": 1}, {"a": {"b": 1, "c": 2}}, {"a.bc": 1}, {"a.b": (1, 2)}, ["a.b"]],
)
def test_a_result_that_was_not_declared_or_cannot_be_stored_is_found(result: object) -> None:
    with pytest.raises(AssertionError):
        CONTRACT.test_writes_only_what_it_declared(Odd(result=result), CASE)


@pytest.mark.parametrize("result", [{"a.b": [1, None]}, {"a": {"b": 1}}, {"a.b": {"c": 2}}, {}])
def test_a_result_that_was_declared_passes(result: object) -> None:
    CONTRACT.test_writes_only_what_it_declared(Odd(result=result), CASE)


def test_an_error_that_is_no_service_error_is_found() -> None:
    service = Odd(act=raising(KeyError("x")))
    with pytest.raises(AssertionError, match="KeyError"):
        CONTRACT.test_writes_only_what_it_declared(service, CASE)


@pytest.mark.parametrize("code", ["", 7])
def test_an_error_code_that_is_no_text_is_found(code: object) -> None:
    service: Service = Odd(act=raising(ServiceError(cast("str", code), "why")))
    with pytest.raises(AssertionError, match="the code is"):
        CONTRACT.test_an_error_has_texts_for_the_mission_to_catch(service, CASE)


def test_a_service_that_does_not_end_in_its_case_is_found() -> None:
    with pytest.raises(AssertionError, match="had not ended"):
        CONTRACT.test_writes_only_what_it_declared(Odd(act=never_end), CASE)


def test_a_service_that_swallows_its_cancellation_is_found() -> None:
    with pytest.raises(AssertionError, match="after it was cancelled"):
        CONTRACT.test_ends_when_it_is_cancelled(Odd(act=swallow_cancellation), CASE)


def test_a_service_that_takes_its_cancellation_for_an_end_is_found() -> None:
    async def act() -> None:
        with contextlib.suppress(asyncio.CancelledError):
            await asyncio.sleep(10)

    with pytest.raises(AssertionError, match="as if it were not"):
        CONTRACT.test_ends_when_it_is_cancelled(Odd(act=act), CASE)


def test_a_service_that_fails_when_cancelled_is_found() -> None:
    async def act() -> None:
        try:
            await asyncio.sleep(10)
        finally:
            raise LookupError("clean-up")

    with pytest.raises(AssertionError, match="LookupError"):
        CONTRACT.test_ends_when_it_is_cancelled(Odd(act=act), CASE)


def test_a_service_that_ends_before_it_is_cancelled_passes() -> None:
    CONTRACT.test_ends_when_it_is_cancelled(Odd(), CASE)
    CONTRACT.test_ends_when_it_is_cancelled(Odd(act=raising(ServiceError("FAILED"))), CASE)
