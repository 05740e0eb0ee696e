"""Campaigns: the same table in one process, a pool and a cluster, and after interruptions."""

import os
import signal
from pathlib import Path

import pytest

from m2pem.campaign import campaign as campaigns
from m2pem.campaign import pool
from m2pem.campaign.campaign import run_campaign
from m2pem.campaign.pool import rehearse_on_processes
from m2pem.campaign.report_files import write_report
from m2pem.campaign.runs import Order, Row, order_of, rehearse_runs, replayed, row_of
from m2pem.campaign.statistics import SequentialTest, estimated, is_good
from m2pem.errors import OperatorError
from m2pem.executive.loading import load_source
from m2pem.fleet.fleet import restore
from m2pem.fleet.fleet_file import load_fleet
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import Rehearser, rehearse, uses_left
from tests.campaign.conftest import MakeOrder

KILLED = "M2PEM_TEST_KILLED"
REPOSITORY = Path(__file__).parents[2]
VIGNETTE1 = b"""
behaviors:
  DriveRoute: {fails: {probability: 0.3, after: 5..60 s, error: ROUTE_BLOCKED}}
services:
  Detector: {after: {exponential: 40 s}, write: [{data: {detection.type: camera}}]}
links: [{vehicle: evsg1, at: 0..100 s, for: {exponential: 5 s}, probability: 0.3}]
vehicles: {evsg1: {battery: 2 %..100 %}}
"""


def test_rows_are_the_same_in_one_process_in_chunks_and_after_a_resume(
    order: MakeOrder, folder: Path
) -> None:
    whole = run_campaign(order(), 30, chunk=30).rows
    first = run_campaign(order(), 12, chunk=5, folder=folder)
    assert [row["run"] for row in first.rows] == list(range(12))
    rest = run_campaign(order(), 30, chunk=7, folder=folder, resume=True)
    assert rest.rows == whole
    with pytest.raises(OperatorError, match="--resume"):
        run_campaign(order(), 30, folder=folder)
    with pytest.raises(OperatorError, match="differs in: seed"):
        run_campaign(order(8), 30, folder=folder, resume=True)


def test_a_pool_gives_the_table_of_one_process(order: MakeOrder) -> None:
    alone = run_campaign(order(), 20, chunk=20).rows
    assert run_campaign(order(), 20, workers=2, chunk=4).rows == alone


def test_a_cluster_of_two_workers_gives_the_table_of_one_process_and_of_a_pool() -> None:
    from distributed import LocalCluster

    mission = load_source(REPOSITORY / "missions/vignette1.bpmn")
    fleet = load_fleet(REPOSITORY / "fleet_configs/vignette1.yaml")
    order = order_of(mission, fleet, VIGNETTE1, 7)
    alone = run_campaign(order, 40, chunk=40).rows
    assert run_campaign(order, 40, workers=2, chunk=8).rows == alone
    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        host="127.0.0.1",
        dashboard_address=None,
    ) as cluster:
        found = run_campaign(order, 40, cluster=cluster.scheduler_address, chunk=8).rows
    assert found == alone


def killing(order: Order, chunk: tuple[int, ...]) -> list[Row]:
    """Rehearse a chunk; the process dies at run 6 the first time, and at run 9 every time."""
    note = Path(os.environ[KILLED])
    if 9 in chunk or (6 in chunk and not note.exists()):
        note.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return rehearse_runs(order, chunk)


def test_a_process_that_is_killed_loses_nothing_and_the_run_that_kills_is_named(
    order: MakeOrder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(KILLED, str(tmp_path / "killed"))
    monkeypatch.setattr(pool, "rehearse_runs", killing)
    chunks = [(0, 1, 2), (3, 4, 5), (6, 7, 8), (9, 10), (11, 12)]
    rows = [row for part in rehearse_on_processes(order(), chunks, 2) for row in part]
    alone = rehearse_runs(order(), range(13))
    found = sorted(rows, key=lambda row: row["run"])
    assert [row["run"] for row in found] == list(range(13))
    assert [row for row in found if row["run"] != 9] == [row for row in alone if row["run"] != 9]
    assert "killed" in found[9]["error"]


def test_an_interrupt_keeps_what_is_done(
    order: MakeOrder, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(order: Order, chunk: tuple[int, ...]) -> list[Row]:
        if 10 in chunk:
            raise KeyboardInterrupt
        return rehearse_runs(order, chunk)

    monkeypatch.setattr(campaigns, "rehearse_runs", interrupted)
    part = run_campaign(order(), 20, chunk=5, folder=folder)
    assert part.interrupted
    assert len(part.rows) == 10
    monkeypatch.undo()
    whole = run_campaign(order(), 20, chunk=5, folder=folder, resume=True)
    assert whole.rows == run_campaign(order(), 20).rows


def test_a_known_probability_lies_in_its_interval_in_most_campaigns(order: MakeOrder) -> None:
    inside = 0
    for seed in range(20):
        rows = run_campaign(order(seed), 60).rows
        estimate = estimated(sum(not is_good(row) for row in rows), len(rows))
        inside += estimate.low <= 0.28 <= estimate.high
    assert inside >= 17  # of 20; with 95 % each, fewer come in 1 of 60 tries, and seeds are fixed


@pytest.mark.long
def test_a_known_probability_lies_in_its_interval_in_95_of_100_campaigns(
    order: MakeOrder,
) -> None:
    inside = 0
    for seed in range(100):
        rows = run_campaign(order(1000 + seed), 200).rows
        estimate = estimated(sum(not is_good(row) for row in rows), len(rows))
        inside += estimate.low <= 0.28 <= estimate.high
    print(f"{inside} of 100 intervals hold 0.28")
    assert inside >= 95


def test_a_sequential_test_ends_a_campaign_when_it_is_decided(order: MakeOrder) -> None:
    test = SequentialTest(0.05, 0.2, 0.05, 0.05)
    result = run_campaign(order(), 2000, test=test, chunk=10)
    assert result.decision == "p1"
    assert result.decided_after <= len(result.rows) < 400
    parallel = run_campaign(order(), 2000, test=test, chunk=3)
    assert (parallel.decision, parallel.decided_after) == ("p1", result.decided_after)


def test_the_worst_run_replays_from_its_answers_file(order: MakeOrder, folder: Path) -> None:
    result = run_campaign(order(), 30, folder=folder)
    write_report(folder, result)
    files = sorted((folder / "worst").iterdir())
    assert len(files) == 5
    report = (folder / "report.md").read_text()
    assert "BLOCKED" in report
    assert "![What failures depend on](effects.svg)" in report
    for file in files:
        run = int(file.stem.removeprefix("run-"))
        _, expected = replayed(result.order, run)
        mission = load_source(result.order.mission)
        fleet = restore(result.order.fleet)
        again = rehearse(mission, fleet, plugins=PluginManager(), answers=file)
        assert again.records == expected.records


def test_a_run_that_cannot_be_rehearsed_is_a_row_with_its_error(
    order: MakeOrder, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise OperatorError("broken")

    monkeypatch.setattr(Rehearser, "rehearse", broken)
    result = run_campaign(order(), 3)
    assert [row["error"] for row in result.rows] == ["broken"] * 3


def test_a_row_has_the_way_of_each_vehicle_and_its_battery_at_the_end() -> None:
    mission = load_source(REPOSITORY / "missions/vignette1.bpmn")
    fleet = load_fleet(REPOSITORY / "fleet_configs/vignette1.yaml")
    blocked = b"behaviors: {DriveRoute: {fails: {probability: 1, after: 10 s}}}"
    orders = order_of(mission, fleet, b"", 7), order_of(mission, fleet, blocked, 7)
    whole, part = (rehearse_runs(order, [0])[0] for order in orders)
    # 5 m/s at most, for 10 s; the whole way is no longer than its time allows.
    assert 0 < part["distance.evsg1"] <= 50 < whole["distance.evsg1"] < 15 * whole["took_s"]
    assert whole["battery.evsg1"] < part["battery.evsg1"] < 1


def test_a_row_does_not_depend_on_reports_of_what_is_left() -> None:
    """They cost half the time of a run, and are left out where nothing reads them."""
    mission = load_source(REPOSITORY / "missions/vignette1.bpmn")
    fleet = load_fleet(REPOSITORY / "fleet_configs/vignette1.yaml")
    order = order_of(mission, fleet, VIGNETTE1, 7)
    assert not uses_left(mission)
    for run in range(12):
        drawn, result = replayed(order, run)
        assert rehearse_runs(order, [run]) == [row_of(run, mission, result, drawn)]
    assert uses_left(load_source(REPOSITORY / "missions/team_column.bpmn"))
