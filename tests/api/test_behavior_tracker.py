"""What the contract of arbiters cannot see of a ledger."""

import logging

import pytest

from m2pem.api import (
    BehaviorReport,
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    BehaviorTracker,
    BehaviorType,
    ParameterKind,
    ParameterSpec,
    ResourceId,
)
from m2pem.errors import StaleCommandError

UGV1 = ResourceId("ugv1")
SPEED = ParameterSpec("speed", ParameterKind.SPEED, minimum=0.0)
GO = BehaviorSpec("go", BehaviorType.VEHICLE, (SPEED,))


def ledger() -> BehaviorTracker:
    return BehaviorTracker(lambda _: (GO,), logging.getLogger("test"))


def request(id_: str, epoch: int = 1, **options: object) -> BehaviorRequest:
    return BehaviorRequest(id_, epoch, "go", {}, (UGV1,), **options)  # type: ignore[arg-type]


def reported(book: BehaviorTracker, virtual) -> list[BehaviorReport]:
    book.close()

    async def main(_):
        return [report async for report in book.reports()]

    return virtual(main)


def test_a_failure_without_a_code_has_the_code_of_its_state(virtual) -> None:
    book = ledger()
    for id_, state in (("r1.b1", BehaviorState.FAILED), ("r1.b2", BehaviorState.LOST)):
        assert book.admit(request(id_))
        book.end(id_, state)
    ends = [report.code for report in reported(book, virtual) if report.state.terminal]
    assert ends == ["FAILED", "LINK_LOST"]


def test_a_refusal_of_the_arbiters_own_is_reported(virtual) -> None:
    book = ledger()
    assert not book.admit(request("r1.b1"), None, lambda _: "it rains")
    (report,) = reported(book, virtual)
    assert (report.state, report.reason) == (BehaviorState.REJECTED, "it rains")


def test_what_is_adopted_goes_on_with_higher_numbers_than_any_before(virtual) -> None:
    book = ledger()
    book.adopt("r1.b1", [UGV1], "native")
    assert book.last("r1.b1").number == 2
    assert book.holder(UGV1) == "r1.b1"
    book.end("r1.b1", BehaviorState.SUCCEEDED)
    assert [report.number for report in reported(book, virtual)] == [3]


def test_a_higher_epoch_starts_an_ended_behavior_again(virtual) -> None:
    book = ledger()
    assert book.admit(request("r1.b1"))
    book.end("r1.b1", BehaviorState.FAILED)
    assert not book.admit(request("r1.b1"))
    assert book.admit(request("r1.b1", epoch=2))
    assert [r.state for r in reported(book, virtual)][-1] is BehaviorState.ACCEPTED


def test_old_behaviors_are_forgotten_and_running_ones_are_not(monkeypatch) -> None:
    monkeypatch.setattr("m2pem.api.behavior_tracker.REMEMBERED", 2)
    book = ledger()
    assert book.admit(request("r1.b1"))
    for number in range(2, 5):
        book.admit(request(f"r1.b{number}"))
    assert book.last("r1.b1").state is BehaviorState.ACCEPTED
    assert book.last("r1.b2").state is BehaviorState.UNKNOWN
    assert book.last("r1.b4").state is BehaviorState.REJECTED


def test_a_reference_is_not_made_for_what_is_refused(virtual) -> None:
    book = ledger()
    made: list[str] = []

    def make() -> str:
        made.append("native")
        return "native"

    assert not book.admit(request("r1.b1"), make, lambda _: "it rains")
    assert made == []
    assert book.admit(request("r1.b2"), make)
    assert [report.native_ref for report in reported(book, virtual)] == [None, "native"]


def test_what_goes_on_may_be_adjusted_by_its_own_executive_only() -> None:
    book = ledger()
    assert not book.may_adjust("r1.b1", 2)
    assert book.admit(request("r1.b1", epoch=2))
    assert book.may_adjust("r1.b1", 2)
    with pytest.raises(StaleCommandError, match=r"adjustment of r1.b1 .* epoch 2 was seen"):
        book.may_adjust("r1.b1", 1)
    book.end("r1.b1", BehaviorState.SUCCEEDED)
    assert not book.may_adjust("r1.b1", 2)


def test_a_reference_that_is_known_late_is_in_what_is_reported_then(virtual) -> None:
    book = ledger()
    assert book.admit(request("r1.b1"))
    book.refer("r1.b1", "one")
    book.progress("r1.b1")
    book.refer("r1.b1", "two")
    book.end("r1.b1", BehaviorState.SUCCEEDED)
    book.refer("r1.b1", "too late")
    book.refer("r1.b2", "of nobody")
    assert [(each.number, each.state, each.native_ref) for each in reported(book, virtual)] == [
        (1, BehaviorState.ACCEPTED, None),
        (2, BehaviorState.RUNNING, "one"),
        (3, BehaviorState.RUNNING, "two"),
        (4, BehaviorState.SUCCEEDED, "two"),
    ]


def test_a_fenced_run_refuses_its_past_executive_and_names_the_newer_one() -> None:
    book = ledger()
    assert book.admit(request("r1.b1"))
    book.fence("r1", 3)
    with pytest.raises(StaleCommandError, match=r"start of r1.b2 .* epoch 1 of r1, and epoch 3"):
        book.admit(request("r1.b2"))
    with pytest.raises(StaleCommandError):
        book.may_cancel("r1.b1", 2)
    assert book.last("r1.b1").epoch == book.last("r1.b2").epoch == 3
    assert book.may_cancel("r1.b1", 3)


def test_what_is_disowned_is_forgotten_without_a_report(virtual) -> None:
    book = ledger()
    assert book.admit(request("r1.b1"))
    assert book.disown("r2") == []
    assert book.disown("r1") == ["r1.b1"]
    assert book.holder(UGV1) is None
    book.end("r1.b1", BehaviorState.FAILED)
    assert [each.state for each in reported(book, virtual)] == [BehaviorState.ACCEPTED]
