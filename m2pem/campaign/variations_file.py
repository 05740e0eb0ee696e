"""The shape of a variations file (docs/campaigns.md), and the JSON Schema for editors."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    RootModel,
    StringConstraints,
    ValidationError,
    WithJsonSchema,
    create_model,
    model_validator,
)

from m2pem.api.simulator_settings import fraction
from m2pem.campaign.distributions import (
    Distribution,
    Quantity,
    distribution_schema,
    read_distribution,
)
from m2pem.errors import AnswersError
from m2pem.fleet.yaml_source import YamlSource, note_shape_findings, parse_yaml, read_yaml
from m2pem.units import UNITS, Dimension, plain_number, quantity

VISITS = 8
"""For so many visits of an element what happens is drawn, unless the file says otherwise."""

LEAST_FACTOR = 0.001
"""A normal distribution of factors begins there."""

_NUMBER = r"\+?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?"
_ABOVE_0 = rf"(?=\+?[0-9]*\.?[0-9]*[1-9]){_NUMBER}"
_SIGNED = rf"-?{_NUMBER}"
_PERCENT = r"\+?(100(\.0*)?|[0-9]{1,2}(\.[0-9]*)?|\.[0-9]+)\s*%"
_FRACTION = r"\+?(1(\.0*)?|0(\.[0-9]*)?|\.[0-9]+|[0-9](\.[0-9]*)?[eE]-[0-9]+)"


def _drawn(
    name: str, quantity: Quantity, value: Mapping[str, Any], interval: str
) -> BeforeValidator:
    """Return what reads a distribution of a quantity. `name`: of its definition in the schema."""

    def read(said: object) -> Distribution:
        return said if isinstance(said, Distribution) else read_distribution(said, quantity)

    schema = distribution_schema(quantity, value, rf"^\s*{interval}\s*$")
    described = RootModel[Annotated[Any, WithJsonSchema(schema)]]
    return BeforeValidator(read, json_schema_input_type=create_model(name, __base__=described))


def _of(dimension: Dimension) -> BeforeValidator:
    """Return what reads a distribution of what cannot be below 0; a bare number is in SI."""

    def read(said: object) -> float:
        value = quantity(said, dimension)
        if value < 0:
            raise ValueError(f"{said!r} is below 0")
        return value

    units = "|".join(UNITS[dimension])
    text = rf"{_NUMBER}\s*({units})?"
    value = {
        "anyOf": [
            {"type": "number", "minimum": 0},
            {"type": "string", "pattern": rf"^\s*{text}\s*$"},
        ],
        "description": f"A {dimension.value}; a bare number is in {next(iter(UNITS[dimension]))}.",
    }
    return _drawn(dimension.value, Quantity(read, 0.0), value, rf"{text}\s*\.\.\s*{text}")


def _factor(said: object) -> float:
    value = plain_number(said)
    if value <= 0:
        raise ValueError(f"{said!r} is not above 0")
    return value


_ANGLE_UNITS = "|".join(UNITS[Dimension.ANGLE])
_ANGLE = Quantity(lambda said: quantity(said, Dimension.ANGLE))

Text = Annotated[str, StringConstraints(min_length=1)]
Seconds = Annotated[Distribution, _of(Dimension.DURATION)]
Speed = Annotated[Distribution, _of(Dimension.SPEED)]
_READ_ANGLE = _drawn(
    "angle",
    _ANGLE,
    {
        "type": "string",
        "pattern": rf"^\s*{_SIGNED}\s*({_ANGLE_UNITS})\s*$",
        "description": "An angle with its unit, such as '45 deg'.",
    },
    rf"{_SIGNED}\s*({_ANGLE_UNITS})?\s*\.\.\s*{_SIGNED}\s*({_ANGLE_UNITS})",
)
Angle = Annotated[Distribution, _READ_ANGLE]
_READ_FRACTION = _drawn(
    "fraction",
    Quantity(fraction, 0.0, 1.0),
    {
        "anyOf": [
            {"type": "number", "minimum": 0, "maximum": 1},
            {"type": "string", "pattern": rf"^\s*({_PERCENT}|{_FRACTION})\s*$"},
        ],
        "description": "A percentage such as '80 %', or a fraction such as 0.8.",
    },
    rf"({_PERCENT[:-1]}%?|{_FRACTION})\s*\.\.\s*({_PERCENT}|{_FRACTION})",
)
Fraction = Annotated[Distribution, _READ_FRACTION]
Factor = Annotated[
    Distribution,
    _drawn(
        "factor",
        Quantity(_factor, LEAST_FACTOR),
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": 0},
                {"type": "string", "pattern": rf"^\s*{_ABOVE_0}\s*$"},
            ]
        },
        rf"{_ABOVE_0}\s*\.\.\s*{_ABOVE_0}",
    ),
]
Probability = Annotated[float, Field(ge=0, le=1)]
Weight = Annotated[float, Field(ge=0)]
Sampled = Annotated[float, Field(gt=0, lt=1)] | None
"""The probability with which it is drawn, in place of `probability`, for the first visit: such runs
count by their weight (importance sampling)."""


def _now() -> Distribution:
    return Distribution("0", lambda _: 0.0)


def _any_direction() -> Distribution:
    return read_distribution("0 deg..360 deg", _ANGLE)


class _Model(BaseModel):
    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, arbitrary_types_allowed=True
    )


class Failure(_Model):
    """With what probability a behavior or service fails, when after its start, and with what."""

    probability: Probability
    sampled: Sampled = None
    after: Seconds = Field(default_factory=_now)
    error: Text = "FAILED"


class VariedBehavior(_Model):
    """Of each visit of a task with a behavior. `duration`: its own, in place of the vehicle's.
    `duration_factor`: how many times as long it takes as by the vehicle's motion."""

    model_config = ConfigDict(
        json_schema_extra={"not": {"required": ["duration", "duration_factor"]}}
    )

    duration: Seconds | None = None
    duration_factor: Factor | None = None
    fails: Failure | None = None

    @model_validator(mode="after")
    def _one_duration(self) -> Self:
        if {"duration", "duration_factor"} <= self.model_fields_set:
            raise ValueError("it has both 'duration' and 'duration_factor': one of them decides")
        return self


class WeightedData(_Model):
    """Data that a service writes, as often as its weight says."""

    weight: Weight = 1.0
    data: dict[Text, Any]


class VariedService(_Model):
    """Of each visit of a service task."""

    after: Seconds = Field(default_factory=_now)
    fails: Failure | None = None
    write: list[WeightedData] = Field(default_factory=list)


class Arrival(_Model):
    """A signal or message from outside, which may also not come."""

    id: Text
    at: Seconds
    probability: Probability = 1.0
    sampled: Sampled = None
    data: dict[Text, Any] = Field(default_factory=dict)


class VariedLink(_Model):
    """A link to a vehicle that is lost at a time, for a while, with a probability."""

    vehicle: Text
    at: Seconds
    for_: Seconds | None = Field(None, alias="for")
    probability: Probability = 1.0
    sampled: Sampled = None


class VariedVehicle(_Model):
    """Settings of a simulated vehicle."""

    battery: Fraction | None = None
    endurance: Seconds | None = None
    max_speed: Speed | None = None
    cruise_speed: Speed | None = None
    climb_rate: Speed | None = None
    wind: Speed | None = None
    wind_from: Angle | None = None


class VariedWind(_Model):
    """The wind. Without `from`, it comes from any direction."""

    speed: Speed
    from_: Angle = Field(default_factory=_any_direction, alias="from")


class VariationsModel(_Model):
    """A whole file."""

    visits: Annotated[int, Field(ge=1, le=1000)] = VISITS
    behaviors: dict[Text, VariedBehavior] = Field(default_factory=dict)
    services: dict[Text, VariedService] = Field(default_factory=dict)
    answers: dict[Text, dict[Text, Weight]] = Field(default_factory=dict)
    answer_times: dict[Text, Seconds] = Field(default_factory=dict)
    signals: list[Arrival] = Field(default_factory=list)
    messages: list[Arrival] = Field(default_factory=list)
    links: list[VariedLink] = Field(default_factory=list)
    vehicles: dict[Text, VariedVehicle] = Field(default_factory=dict)
    wind: VariedWind | None = None


def read_model(said: Path | bytes) -> tuple[VariationsModel, YamlSource]:
    """Return what a variations file says, or its text, and where in it it says so.

    Raises:
        AnswersError: with every finding, each with its line.
    """
    source = parse_yaml(said, "variations.yaml") if isinstance(said, bytes) else read_yaml(said)
    model = VariationsModel()
    if not source.findings and source.data is not None:
        try:
            model = VariationsModel.model_validate(source.data)
        except ValidationError as error:
            note_shape_findings(source, error, VariationsModel)
    for element in model.answer_times:
        if element not in model.answers:
            what = f"`answers` does not say what is decided at {element}"
            source.error(("answer_times", element), "bad-value", what)
    if source.findings:
        what = f"{source.file} is no variations file that can be used"
        raise AnswersError(what, source.findings)
    return model, source


def variations_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of variations files, for editors:
    `m2pem campaign --schema`."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "https://m2pem.org/schema/1/variations.schema.json",
        **VariationsModel.model_json_schema(),
        "title": "m2pem variations",
    }
