"""Rare failures are drawn more often than they come, and runs count by their weights."""

import pytest
from scipy import stats

from m2pem.campaign.campaign import run_campaign
from m2pem.campaign.report import report_of
from m2pem.campaign.report_files import markdown_lines
from m2pem.campaign.runs import Order, Row, order_of
from m2pem.campaign.statistics import (
    SequentialTest,
    compared,
    effects,
    ends,
    estimated,
    failure,
    quantiles,
    weight_of,
)
from m2pem.campaign.variations import Variations, read_variations
from m2pem.errors import AnswersError, OperatorError
from m2pem.executive.loading import load_source
from m2pem.fleet.default_fleet import fleet_for
from tests.campaign.conftest import HEAD, task

RARE = 1e-4
BOTH = b"""
visits: 1
behaviors:
  A: {fails: {probability: 0.01, sampled: 0.3}}
  B: {fails: {probability: 0.01, sampled: 0.3}}
"""
FLOWS = "S_A A_E onA_B B_E"


def backed_up() -> bytes:
    """B is commanded where A fails; the mission fails with both, with probability 0.01 * 0.01."""
    parts = ['<startEvent id="S"/><endEvent id="E"/>', task("A"), task("B")]
    parts.append(
        '<boundaryEvent id="onA" attachedToRef="A"><errorEventDefinition/></boundaryEvent>'
    )
    for flow in FLOWS.split():
        source, target = flow.split("_")
        parts.append(f'<sequenceFlow id="{flow}" sourceRef="{source}" targetRef="{target}"/>')
    return f'{HEAD}<process id="P">{"".join(parts)}</process></definitions>'.encode()


def order(seed: int, variations: bytes = BOTH) -> Order:
    loaded = load_source(backed_up())
    return order_of(loaded, fleet_for(loaded), variations, seed)


def drawn_row(variations: Variations, seed: int, run: int) -> Row:
    """The row of a run by what is drawn for it, without a rehearsal."""
    drawn = variations.draw(seed, run)
    fails = all(drawn.values[f"behaviors.{each}.fails"] for each in "AB")
    return {
        "run": run,
        "outcome": "failed" if fails else "completed",
        "end": "FAILED" if fails else "E",
        "good": not fails,
        "took_s": 10.0 + run,
        "error": "",
        "weight": drawn.weight,
        **{f"drawn.{key}": value for key, value in drawn.values.items()},
    }


def test_rows_of_rehearsals_are_what_is_drawn() -> None:
    variations = read_variations(BOTH)
    for row in run_campaign(order(3), 30).rows:
        expected = drawn_row(variations, 3, row["run"])
        assert (row["good"], row["weight"]) == (expected["good"], expected["weight"])


def test_a_rare_failure_lies_in_its_interval_with_few_runs() -> None:
    variations = read_variations(BOTH)
    inside, widths = 0, []
    for seed in range(100):
        found = failure([drawn_row(variations, seed, run) for run in range(300)])
        inside += found.low <= RARE <= found.high
        widths.append(found.high - found.low)
    assert inside >= 90
    # As many plain runs say next to nothing: with none that failed, it may be 120 times as likely.
    assert max(widths) < 2 * RARE < estimated(0, 300).high / 60


@pytest.mark.long
@pytest.mark.timeout(3000)
def test_a_rare_failure_lies_in_its_interval_in_90_of_100_campaigns() -> None:
    inside = 0
    for seed in range(100):
        found = failure(run_campaign(order(1000 + seed), 150).rows)
        inside += found.low <= RARE <= found.high
    print(f"{inside} of 100 intervals hold {RARE}")
    assert inside >= 90


def test_probabilities_of_all_ends_add_up_and_hold_the_known_ones() -> None:
    variations = read_variations(BOTH)
    rows = [drawn_row(variations, 5, run) for run in range(2000)]
    found = ends(rows)
    assert sum(each.share for each in found.values()) == pytest.approx(1)
    completed = found["completed", "E"]
    assert completed.low <= 1 - RARE <= completed.high
    assert sum(map(weight_of, rows)) / 2000 == pytest.approx(1, abs=0.1)


def test_equal_weights_give_the_exact_interval_of_a_count() -> None:
    rows = [
        {"good": run >= 7, "weight": 0.001 if run < 7 else 1.1, "error": ""} for run in range(100)
    ]
    found = failure(rows)
    low, high = stats.chi2.ppf(0.025, 14) / 2, stats.chi2.ppf(0.975, 16) / 2
    assert (found.low, found.high) == pytest.approx((low * 1e-5, high * 1e-5))
    none = failure([{**row, "good": True} for row in rows])
    assert none.low == 0
    assert 0.03 < none.high < 0.06  # of 100 runs with weights up to 1.1


def test_what_failures_depend_on_is_weighted_too() -> None:
    variations = read_variations(BOTH)
    rows = [drawn_row(variations, 5, run) for run in range(3000)]
    found = {each.name: each for each in effects(rows)}
    for name in ("behaviors.A.fails", "behaviors.B.fails"):
        effect = found[name]
        assert effect.low <= 0.01 <= effect.high
        assert effect.share == pytest.approx(0.01, rel=0.2)
        assert effect.cost == pytest.approx(RARE, rel=0.5)


def test_quantities_and_differences_are_weighted() -> None:
    values = quantiles([1.0, 2.0, 3.0], [1.0, 1.0, 18.0])
    assert (values.low, values.median, values.high) == (1, 3, 3)
    assert values.mean == pytest.approx((1 + 2 + 54) / 20)
    variations = read_variations(BOTH)
    rows = [drawn_row(variations, 5, run) for run in range(1000)]
    better = [{**row, "good": True, "took_s": row["took_s"] - 1} for row in rows]
    difference = compared(better, rows)
    share, low, high = difference.failure
    assert share == pytest.approx(failure(rows).share)
    assert low <= RARE <= high
    assert difference.took_s[0] == pytest.approx(1)


def test_links_signals_and_services_may_be_sampled() -> None:
    text = b"""
services: {Look: {fails: {probability: 0.001, sampled: 0.5}}}
signals: [{id: stop, at: 5 s, probability: 0.9, sampled: 0.5}]
links: [{vehicle: uav1, at: 5 s, probability: 0.01, sampled: 0.5}]
"""
    variations = read_variations(text)
    assert variations.weighted
    drawn = [variations.draw(1, run) for run in range(4000)]
    for key, probability in (
        ("services.Look.fails", 0.001),
        ("signals.stop.comes", 0.9),
        ("links.uav1.lost", 0.01),
    ):
        such = sum(each.weight for each in drawn if each.values[key]) / 4000
        assert such == pytest.approx(probability, rel=0.1)
        assert sum(bool(each.values[key]) for each in drawn) == pytest.approx(2000, abs=150)


def test_later_visits_are_drawn_as_they_are() -> None:
    text = BOTH.replace(b"visits: 1", b"visits: 50")
    drawn = [read_variations(text).draw(1, run) for run in range(100)]
    later = [each.answers["behaviors"]["A"][visit] for each in drawn for visit in range(1, 50)]
    assert sum(each["end"] == "failed" for each in later) < 100


def test_a_sequential_test_does_not_go_with_it() -> None:
    with pytest.raises(OperatorError, match="`sampled`"):
        run_campaign(order(1), 10, test=SequentialTest(0.1, 0.2, 0.05, 0.05))


@pytest.mark.parametrize("sampled", ["0", "1", "1.5", "-0.1"])
def test_what_is_always_or_never_drawn_is_not_sampled(sampled: str) -> None:
    text = f"links: [{{vehicle: uav1, at: 5 s, probability: 0.5, sampled: {sampled}}}]"
    with pytest.raises(AnswersError, match=r"variations.yaml:1.*sampled"):
        read_variations(text.encode())


def test_the_report_says_that_runs_are_weighted() -> None:
    text = "\n".join(markdown_lines(report_of(run_campaign(order(5), 60))))
    assert "each run counts by its weight" in text
    assert "e-04 to" in text or "e-05 to" in text
    plain = run_campaign(order(5, b"behaviors: {A: {fails: {probability: 0.2}}}"), 20)
    assert "weight" not in "\n".join(markdown_lines(report_of(plain)))
