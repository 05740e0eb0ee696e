"""Summaries of runs, as operators see them."""

from m2pem.api import RunStatus, RunSummary


def test_a_run_took_the_time_from_its_start_to_its_end() -> None:
    ended = RunSummary("r1", "m.bpmn", "P", RunStatus.COMPLETED, 1_000_000, 3_500_000)
    assert ended.took_s == 2.5


def test_a_run_that_has_not_ended_has_taken_no_time() -> None:
    assert RunSummary("r1", "m.bpmn", "P", RunStatus.RUNNING, 1_000_000).took_s is None
