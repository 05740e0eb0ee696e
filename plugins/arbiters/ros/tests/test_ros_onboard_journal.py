"""What the node on board says of behaviors: each change once, and one behavior at a time."""

from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_ros.interfaces.behavior_status import ENDS, Status
from m2pem_plugin_ros.onboard import journal as module
from m2pem_plugin_ros.onboard.journal import BehaviorJournal

from m2pem.api import BehaviorState, EpochFence

IDS = ("a", "b", "c", "d")
ENDINGS = sorted(ENDS - {BehaviorState.REJECTED})


def test_a_behavior_is_accepted_runs_and_ends_with_numbers_that_rise() -> None:
    said: list[Status] = []
    book = BehaviorJournal(said.append)
    book.accept("a")
    book.progress("a")
    book.progress("a")
    book.end("a", BehaviorState.FAILED, "ROUTE_BLOCKED", "a wall")
    book.end("a", BehaviorState.SUCCEEDED)
    assert said == [
        Status("a", 1, BehaviorState.ACCEPTED),
        Status("a", 2, BehaviorState.RUNNING),
        Status("a", 3, BehaviorState.FAILED, "ROUTE_BLOCKED", "a wall"),
    ]
    assert book.last("a") == said[-1]


def test_what_is_left_is_said_when_it_has_changed_while_it_runs() -> None:
    said: list[Status] = []
    book = BehaviorJournal(said.append)
    book.accept("a")
    book.remains("a", {"area": "all"})
    book.progress("a")
    for left in ("most", "most", "rest"):
        book.remains("a", {"area": left})
    book.remains("b", {"area": "most"})
    book.end("a", BehaviorState.CANCELLED)
    book.remains("a", {"area": "all"})
    assert [(each.number, each.remaining) for each in said[1:]] == [
        (2, None),
        (3, {"area": "most"}),
        (4, {"area": "rest"}),
        (5, None),
    ]


def test_who_takes_over_ends_what_went_on() -> None:
    said: list[Status] = []
    book = BehaviorJournal(said.append)
    book.accept("a")
    book.accept("b")
    assert [(status.id, status.state) for status in said] == [
        ("a", BehaviorState.ACCEPTED),
        ("a", BehaviorState.CANCELLED),
        ("b", BehaviorState.ACCEPTED),
    ]
    assert book.current == "b"


def test_what_was_never_heard_of_is_unknown_with_number_0() -> None:
    said: list[Status] = []
    BehaviorJournal(said.append).repeat("a")
    assert (said[0].id, said[0].number, said[0].state) == ("a", 0, BehaviorState.UNKNOWN)


def test_a_lower_epoch_of_the_same_run_is_past() -> None:
    book = BehaviorJournal(lambda _: None)
    seen = (("r", 2), ("r", 1), ("s", 1), ("r", 3), ("r", 2))
    assert [book.epochs.admit_run(*each) for each in seen] == [True, False, True, True, False]


def test_epochs_in_a_file_refuse_past_executives_after_a_restart(tmp_path: Path) -> None:
    file = tmp_path / "epochs.json"
    book = BehaviorJournal(lambda _: None, EpochFence(file))
    assert book.epochs.admit_run("run.of.any.name", 3)
    again = BehaviorJournal(lambda _: None, EpochFence(file))
    assert not again.epochs.admit_run("run.of.any.name", 2)
    newest = again.epochs.newest_of_run
    assert (newest("run.of.any.name"), newest("run.of")) == (3, 0)


def test_of_very_many_the_oldest_are_forgotten_but_not_what_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "REMEMBERED", 3)
    book = BehaviorJournal(lambda _: None)
    book.accept("goes on")
    for number in range(5):
        book.reject(f"{number}", "REJECTED", "no")
        book.epochs.admit_run(f"{number}", 1)
    assert [id_ for id_ in ("goes on", "0", "2", "3", "4") if book.knows(id_)] == [
        "goes on",
        "3",
        "4",
    ]
    assert book.current == "goes on"


actions = st.lists(
    st.one_of(
        st.tuples(st.just("accept"), st.sampled_from(IDS)),
        st.tuples(st.just("reject"), st.sampled_from(IDS)),
        st.tuples(st.just("progress"), st.sampled_from(IDS)),
        st.tuples(st.just("end"), st.sampled_from(IDS), st.sampled_from(ENDINGS)),
    ),
    max_size=30,
)


@given(actions)
def test_whatever_happens_each_behavior_keeps_the_order_of_statuses(
    happening: list[tuple[object, ...]],
) -> None:
    said: list[Status] = []
    book = BehaviorJournal(said.append)
    for action, id_, *rest in happening:
        assert isinstance(id_, str)
        if action == "progress":
            book.progress(id_)
        elif action == "end":
            assert isinstance(rest[0], BehaviorState)
            book.end(id_, rest[0])
        elif not book.knows(id_) and action == "accept":
            book.accept(id_)
        elif not book.knows(id_):
            book.reject(id_, "REJECTED", "no")
    for id_ in IDS:
        of_it = [status for status in said if status.id == id_]
        numbers = [status.number for status in of_it]
        assert numbers == list(range(1, len(numbers) + 1))
        assert all(earlier.state not in ENDS for earlier, _ in pairwise(of_it))
        if of_it:
            assert of_it[0].state in (BehaviorState.ACCEPTED, BehaviorState.REJECTED)
    open_ones = {id_ for id_ in IDS if book.knows(id_) and book.last(id_).state not in ENDS}
    assert open_ones == ({book.current} if book.current else set())
