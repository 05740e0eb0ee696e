import math
import random

import pytest
from scipy import stats

from m2pem.campaign.runs import Row
from m2pem.campaign.statistics import (
    SequentialTest,
    compared,
    effects,
    ends,
    estimated,
    quantiles,
    worst,
)


def row(run: int, good: bool, took_s: float = 10.0, **drawn: float | bool | str) -> Row:
    return {
        "run": run,
        "outcome": "completed" if good else "failed",
        "end": "E" if good else "BLOCKED",
        "good": good,
        "took_s": took_s,
        "error": "",
        **{f"drawn.{key}": value for key, value in drawn.items()},
    }


def test_an_interval_is_the_exact_one() -> None:
    estimate = estimated(7, 100)
    assert estimate.low == pytest.approx(stats.beta.ppf(0.025, 7, 94))
    assert estimate.high == pytest.approx(stats.beta.ppf(0.975, 8, 93))
    assert estimated(0, 0) == estimated(0, 0)


def test_ends_are_counted_the_most_likely_first() -> None:
    counted = ends([row(0, True), row(1, False), row(2, True)])
    assert [(end, each.count) for end, each in counted.items()] == [
        (("completed", "E"), 2),
        (("failed", "BLOCKED"), 1),
    ]


def test_quantiles_of_even_values() -> None:
    found = quantiles([float(each) for each in range(101)])
    assert (found.low, found.median, found.high, found.mean) == (5, 50, 95, 50)


def test_what_failures_depend_on_comes_first_and_what_they_do_not_is_uncertain() -> None:
    chance = random.Random(1)
    rows = []
    for run in range(1000):
        wind, blocked, way = chance.random(), chance.random() < 0.3, chance.choice("ab")
        good = chance.random() > (0.05 + 0.6 * blocked)
        took_s = 10 + 20 * wind
        rows.append(row(run, good, took_s, wind=wind, blocked=blocked, way=way, constant=1.0))
    found = effects(rows)
    assert {each.name for each in found} == {"wind", "blocked", "way"}
    assert found[0].name == "blocked"
    assert found[0].low < 0.6 < found[0].high
    assert found[0].certain
    [of_wind] = [each for each in found if each.name == "wind"]
    took_s, low, high = of_wind.took_s
    assert took_s == pytest.approx(10, rel=0.1)
    assert low < 10 < high
    assert found[0].cost == pytest.approx(0.3 * 0.6, rel=0.2)
    assert abs(of_wind.failure) < 0.1
    assert abs(of_wind.rank) < 0.1


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("wind", 6.5, "6.5 m/s"),
        ("wind.from", math.pi / 2, "90 deg"),
        ("vehicles.uav1.wind_from", math.pi, "180 deg"),
        ("vehicles.uav1.battery", 0.625, "62.5 %"),
        ("vehicles.uav1.climb_rate", 2.0, "2 m/s"),
        ("vehicles.uav1.endurance", 600.0, "600 s"),
        ("behaviors.A.duration", 12.5, "12.5 s"),
        ("behaviors.A.duration_factor", 1.5, "1.5 times"),
        ("links.uav1.1.for", 3.0, "3 s"),
    ],
)
def test_what_is_compared_with_a_value_says_its_unit(name: str, value: float, text: str) -> None:
    rows = [row(run, True, **{name: value + (run - 1) / 100}) for run in range(3)]
    [effect] = effects(rows)
    assert effect.split == f"above {text}"


def test_what_is_drawn_in_few_runs_costs_little() -> None:
    rows = [row(run, True) for run in range(900)]
    rows += [row(run, run % 2 == 0, at=float(run % 2) + run / 1e6) for run in range(900, 1000)]
    [effect] = effects(rows)
    assert effect.failure == 1
    assert effect.cost == pytest.approx(0.05)


def test_pairs_are_compared_more_exactly_than_two_groups() -> None:
    first = [row(run, run % 3 > 0, 100.0 + run) for run in range(300)]
    second = [row(run, run % 3 > 0 and run % 30 != 1, 95.0 + run) for run in range(250)]
    found = compared(first, second)
    assert found.pairs == 250
    failure, lowest, highest = found.failure
    assert failure == pytest.approx(9 / 250)
    assert 0 < lowest < failure < highest < 0.07
    assert found.took_s == (-5, -5, -5)
    assert math.isnan(compared([], []).failure[0])


def test_a_sequential_test_keeps_its_errors() -> None:
    test = SequentialTest(0.1, 0.2, 0.05, 0.05)
    for probability, wrong in ((0.1, "p1"), (0.2, "p0")):
        chance = random.Random(3)
        decided = [
            test.decide(chance.random() < probability for _ in range(10_000)) for _ in range(400)
        ]
        assert "" not in {decision for decision, _ in decided}
        # Wald's bounds hold: 5 % at most, here with five standard deviations of the count.
        errors = sum(decision == wrong for decision, _ in decided)
        assert errors <= 400 * 0.05 + 5 * math.sqrt(400 * 0.05 * 0.95)
        assert sum(runs for _, runs in decided) / 400 < 300
    assert test.decide([True, False]) == ("", 2)


@pytest.mark.parametrize("values", [(0.2, 0.1, 0.05, 0.05), (0.1, 0.2, 0, 0.1), (0, 0.1, 0.1, 0.1)])
def test_a_test_of_nothing_is_refused(values: tuple[float, float, float, float]) -> None:
    with pytest.raises(ValueError, match=r"<|between"):
        SequentialTest(*values)


def test_the_worst_runs_failed_or_took_longest() -> None:
    rows = [row(0, True, 50), row(1, False, 5), row(2, True, 90), row(3, False, 7)]
    assert [each["run"] for each in worst(rows, 3)] == [3, 1, 2]
