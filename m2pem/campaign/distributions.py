"""Distributions of what a campaign varies, by their inverse distribution functions.

Each turns a number of 0 to 1, drawn evenly, into a value that rises with it. So two campaigns that
draw the same number get corresponding values (common random numbers), whatever they differ in.
"""

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any


@dataclass(frozen=True, slots=True)
class Quantity:
    """What is drawn: how a value is read, which may raise ValueError, and its bounds."""

    read: Callable[[object], float]
    low: float = -math.inf
    high: float = math.inf


@dataclass(frozen=True, slots=True)
class Distribution:
    """A distribution of real numbers. `value` gives that at which the distribution function is
    `share`, 0 < share < 1."""

    text: str
    value: Callable[[float], float]


@dataclass(frozen=True, slots=True)
class Draw:
    """The draws of one run: each by the seed, the run, what is drawn, and for which visit.

    A draw depends on nothing else: neither on other draws, nor on the process that makes it.
    """

    seed: int
    run: int

    def share(self, key: str, visit: int = 0) -> float:
        """Return a number between 0 and 1, neither of which it is."""
        text = f"{self.seed}\0{self.run}\0{key}\0{visit}".encode()
        digest = hashlib.blake2b(text, digest_size=8).digest()
        return ((int.from_bytes(digest, "big") >> 11) + 0.5) / 2**53


def distribution_schema(
    quantity: Quantity, value: Mapping[str, Any], interval: str
) -> dict[str, Any]:
    """Return the JSON Schema of a distribution. `value`: that of a value. `interval`: the pattern
    of LOW..HIGH."""
    positive = {"type": "number", "exclusiveMinimum": 0}

    def several(count: int) -> dict[str, Any]:
        return {"type": "array", "items": value, "minItems": count, "maxItems": count}

    def named(optional: str = "", **parameters: Mapping[str, Any]) -> dict[str, Any]:
        return {
            "type": "object",
            "properties": {**parameters, **dict.fromkeys(optional.split(), value)},
            "required": list(parameters),
            "additionalProperties": False,
        }

    kinds: dict[str, Mapping[str, Any]] = {
        "uniform": several(2),
        "normal": named("low high", mean=value, sd=value),
        "triangular": several(3),
    }
    if math.isinf(quantity.high):
        kinds |= {
            "lognormal": named(median=value, sigma=positive),
            "exponential": value,
            "weibull": named(scale=value, shape=positive),
        }
    one_kind = {
        "type": "object",
        "properties": kinds,
        "additionalProperties": False,
        "minProperties": 1,
        "maxProperties": 1,
    }
    return {"anyOf": [value, {"type": "string", "pattern": interval}, one_kind]}


def weighted(weights: Mapping[str, float], share: float) -> str:
    """Return the choice at a share of all weights, in their order."""
    left = share * sum(weights.values())
    for choice, weight in weights.items():
        left -= weight
        if left < 0:
            return choice
    return [choice for choice, weight in weights.items() if weight > 0][-1]  # it was rounded


def read_distribution(said: object, quantity: Quantity) -> Distribution:
    """Read a distribution: a value, `LOW..HIGH`, or a map with the name of a distribution.

    Raises:
        ValueError: it is none; the message says what would be right.
    """
    if isinstance(said, str) and ".." in said:
        low, _, high = (part.strip() for part in said.partition(".."))
        unit = high.lstrip("+-0123456789.eE").strip()
        return _uniform(
            [low if not unit or low[-1:].isalpha() or "%" in low else low + unit, high], quantity
        )
    if not isinstance(said, Mapping):
        value = quantity.read(said)
        return Distribution(str(said), lambda _: value)
    if len(said) != 1 or (kind := next(iter(said))) not in _KINDS:
        raise ValueError(f"a distribution is a value, LOW..HIGH or one of {', '.join(_KINDS)}")
    return _KINDS[kind](said[kind], quantity)


def _numbers(said: object, count: int, what: str, quantity: Quantity) -> list[float]:
    if not isinstance(said, list) or len(said) != count:
        raise ValueError(f"{what}: a list of {count} values")
    return [quantity.read(each) for each in said]


def _uniform(said: object, quantity: Quantity) -> Distribution:
    low, high = _numbers(said, 2, "uniform: [low, high]", quantity)
    if low > high:
        raise ValueError(f"uniform: {low:g} is above {high:g}")
    return Distribution(f"uniform {low:g}..{high:g}", lambda share: low + (high - low) * share)


def _triangular(said: object, quantity: Quantity) -> Distribution:
    low, mode, high = _numbers(said, 3, "triangular: [low, mode, high]", quantity)
    if not low <= mode <= high or low == high:
        raise ValueError("triangular: low <= mode <= high, and low < high")
    turn = (mode - low) / (high - low)

    def value(share: float) -> float:
        if share < turn:
            return low + math.sqrt(share * (high - low) * (mode - low))
        return high - math.sqrt((1 - share) * (high - low) * (high - mode))

    return Distribution(f"triangular {low:g}, {mode:g}, {high:g}", value)


def _parameters(said: object, what: str, needed: str, optional: str = "") -> Mapping[str, Any]:
    names = [*needed.split(), *optional.split()]
    if not isinstance(said, Mapping) or not set(needed.split()) <= set(said) <= set(names):
        raise ValueError(f"{what}: a map of {', '.join(names)}")
    return said


def _refuse_bound(kind: str, quantity: Quantity) -> None:
    if quantity.high < math.inf:
        fit = "uniform, normal or triangular"
        raise ValueError(f"{kind} has no upper bound, and this is {quantity.high:g} at most: {fit}")


def _normal(said: object, quantity: Quantity) -> Distribution:
    given = _parameters(said, "normal", "mean sd", "low high")
    mean, sd = quantity.read(given["mean"]), quantity.read(given["sd"])
    low = quantity.read(given["low"]) if "low" in given else quantity.low
    high = quantity.read(given["high"]) if "high" in given else quantity.high
    if sd <= 0 or low >= high:
        raise ValueError("normal: sd is above 0, and low below high")
    normal = NormalDist(mean, sd)
    below, upto = normal.cdf(low), normal.cdf(high)
    if upto - below < 1e-9:
        raise ValueError("normal: next to nothing of it lies between low and high")

    def value(share: float) -> float:
        return min(high, max(low, normal.inv_cdf(below + (upto - below) * share)))

    return Distribution(f"normal {mean:g}, {sd:g}", value)


def _lognormal(said: object, quantity: Quantity) -> Distribution:
    given = _parameters(said, "lognormal", "median sigma")
    _refuse_bound("lognormal", quantity)
    median, sigma = quantity.read(given["median"]), _plain(given["sigma"])
    if median <= 0 or sigma <= 0:
        raise ValueError("lognormal: median and sigma are above 0")
    normal = NormalDist()
    return Distribution(
        f"lognormal {median:g}, {sigma:g}",
        lambda share: median * math.exp(sigma * normal.inv_cdf(share)),
    )


def _exponential(said: object, quantity: Quantity) -> Distribution:
    mean = quantity.read(said)
    _refuse_bound("exponential", quantity)
    if mean <= 0:
        raise ValueError("exponential: the mean is above 0")
    return Distribution(f"exponential {mean:g}", lambda share: -mean * math.log1p(-share))


def _weibull(said: object, quantity: Quantity) -> Distribution:
    given = _parameters(said, "weibull", "scale shape")
    _refuse_bound("weibull", quantity)
    scale, shape = quantity.read(given["scale"]), _plain(given["shape"])
    if scale <= 0 or shape <= 0:
        raise ValueError("weibull: scale and shape are above 0")
    return Distribution(
        f"weibull {scale:g}, {shape:g}",
        lambda share: scale * (-math.log1p(-share)) ** (1 / shape),
    )


def _plain(said: object) -> float:
    if isinstance(said, bool) or not isinstance(said, int | float):
        raise ValueError(f"{said!r} is not a number")  # noqa: TRY004  # pydantic reads it
    return float(said)


_KINDS: Mapping[str, Callable[[object, Quantity], Distribution]] = {
    "uniform": _uniform,
    "normal": _normal,
    "lognormal": _lognormal,
    "triangular": _triangular,
    "exponential": _exponential,
    "weibull": _weibull,
}
