"""The shape of an answers file (docs/rehearsal.md), as pydantic models.

Unknown keys are refused. Whether its names fit a mission is checked by `answers_check`.
"""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    ValidationError,
    model_validator,
)

from m2pem.errors import AnswersError
from m2pem.fleet.shape_findings import note_shape_findings
from m2pem.fleet.yaml_source import YamlSource, parse_yaml, read_yaml
from m2pem.units import Dimension, quantity

_NAME = "answers.yaml"
"""What findings call a text that did not come from a file."""


def _seconds(value: object) -> float:
    seconds = quantity(value, Dimension.DURATION)
    if seconds < 0:
        raise ValueError(f"{value!r} is below 0")
    return seconds


Seconds = Annotated[float, BeforeValidator(_seconds)]
"""A duration with its unit, or a number of seconds; 0 is one."""

Text = Annotated[str, StringConstraints(min_length=1)]


class _Model(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class ServiceEntry(_Model):
    """One visit to a service task: after a while it writes, or fails with an error code."""

    after: Seconds = 0.0
    write: dict[Text, Any] = Field(default_factory=dict)
    error: Text | None = None

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        if self.error is not None and self.write:
            raise ValueError("it has both 'write' and 'error': a service writes or fails")
        return self


class BehaviorEntry(_Model):
    """One behavior that a task commands, on a simulated vehicle or payload."""

    after: Seconds
    end: Literal["succeeded", "failed", "stalled", "lost"]
    error: Text | None = None

    @model_validator(mode="after")
    def _error_of_a_failure(self) -> Self:
        if self.error is not None and self.end in ("succeeded", "stalled"):
            raise ValueError(f"'error' goes with 'end: failed' or 'end: lost', not {self.end}")
        return self


class TimedEntry(_Model):
    """A signal or message from outside; `at` counts from the start of the run."""

    at: Seconds
    id: Text
    data: dict[Text, Any] = Field(default_factory=dict)


class AnswersModel(_Model):
    """A whole file. Lists are used visit by visit."""

    answers: dict[Text, list[Text]] = Field(default_factory=dict)
    signals: list[TimedEntry] = Field(default_factory=list)
    messages: list[TimedEntry] = Field(default_factory=list)
    services: dict[Text, list[ServiceEntry]] = Field(default_factory=dict)
    behaviors: dict[Text, list[BehaviorEntry]] = Field(default_factory=dict)


def read_answers(answers: Path | bytes) -> tuple[AnswersModel, YamlSource]:
    """What a file says, or its text, and where in it it says so.

    Raises:
        AnswersError: with every finding, each with its line and the dotted path of the key.
    """
    source = parse_yaml(answers, _NAME) if isinstance(answers, bytes) else read_yaml(answers)
    model = AnswersModel()
    if not source.findings and source.data is not None:
        try:
            model = AnswersModel.model_validate(source.data)
        except ValidationError as error:
            note_shape_findings(source, error, AnswersModel)
    if source.findings:
        raise AnswersError(f"{source.file} is no answers file that can be used", source.findings)
    return model, source
