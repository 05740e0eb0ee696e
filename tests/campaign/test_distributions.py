"""Distributions, judged by scipy's."""

import math
from collections.abc import Mapping
from typing import Any

import pytest
from scipy import stats

from m2pem.campaign.distributions import Draw, Quantity, read_distribution, weighted
from m2pem.units import Dimension, quantity

SHARES = (0.001, 0.1, 0.3, 0.5, 0.9, 0.999)


SECONDS = Quantity(lambda said: quantity(said, Dimension.DURATION))
AT_LEAST_0 = Quantity(SECONDS.read, 0.0)


@pytest.mark.parametrize(
    ("said", "judge"),
    [
        ("30..90 s", stats.uniform(30, 60)),
        ("1..2 min", stats.uniform(60, 60)),
        ("500 ms..2 s", stats.uniform(0.5, 1.5)),
        ({"uniform": ["2 s", "5 s"]}, stats.uniform(2, 3)),
        ({"triangular": [0, 3, 10]}, stats.triang(0.3, 0, 10)),
        ({"normal": {"mean": "10 s", "sd": "2 s"}}, stats.norm(10, 2)),
        (
            {"normal": {"mean": 10, "sd": 2, "low": 9, "high": 15}},
            stats.truncnorm(-0.5, 2.5, 10, 2),
        ),
        ({"lognormal": {"median": 5, "sigma": 0.4}}, stats.lognorm(0.4, scale=5)),
        ({"exponential": "20 s"}, stats.expon(scale=20)),
        ({"weibull": {"scale": 7, "shape": 1.5}}, stats.weibull_min(1.5, scale=7)),
    ],
)
def test_a_distribution_is_that_of_scipy(said: object, judge: Any) -> None:
    distribution = read_distribution(said, SECONDS)
    for share in SHARES:
        assert distribution.value(share) == pytest.approx(judge.ppf(share))


@pytest.mark.parametrize(
    "said",
    [
        "5..2 s",
        "5..x",
        {"uniform": [1]},
        {"uniform": [1, 2, 3]},
        {"gauss": [1, 2]},
        {"normal": {"mean": 1}},
        {"normal": {"mean": 1, "sd": 0}},
        {"normal": {"mean": 0, "sd": 1, "low": 50}},
        {"triangular": [3, 1, 2]},
        {"exponential": 0},
        {"weibull": {"scale": 1, "shape": "2 s"}},
        {"lognormal": {"median": -1, "sigma": 1}},
        {},
    ],
)
def test_what_is_no_distribution_is_refused(said: Mapping[str, object] | str) -> None:
    with pytest.raises(ValueError, match=r".+"):
        read_distribution(said, SECONDS)


def test_what_has_bounds_is_drawn_within_them() -> None:
    said = {"normal": {"mean": "2 s", "sd": "4 s"}}
    distribution = read_distribution(said, AT_LEAST_0)
    for share in SHARES:
        judge = stats.truncnorm(-0.5, math.inf, 2, 4)
        assert distribution.value(share) == pytest.approx(judge.ppf(share))
    lifelong = {"exponential": "1 s"}
    with pytest.raises(ValueError, match="no upper bound, and this is 5 at most"):
        read_distribution(lifelong, Quantity(SECONDS.read, 0.0, 5.0))


def test_draws_are_even_and_depend_on_each_of_their_names() -> None:
    shares = [Draw(7, run).share("behaviors.Drive.fails") for run in range(5000)]
    assert stats.kstest(shares, "uniform").pvalue > 0.001
    one = Draw(7, 1).share("a", 1)
    others = {Draw(8, 1).share("a", 1), Draw(7, 2).share("a", 1), Draw(7, 1).share("b", 1)}
    assert one not in {*others, Draw(7, 1).share("a", 2)}
    assert one == Draw(7, 1).share("a", 1)


def test_a_choice_is_as_likely_as_its_weight_says() -> None:
    weights = {"never": 0.0, "a": 1.0, "b": 3.0}
    drawn = [weighted(weights, (number + 0.5) / 1000) for number in range(1000)]
    assert {choice: drawn.count(choice) for choice in weights} == {"never": 0, "a": 250, "b": 750}
