"""What a campaign varies: the answers that are drawn by a variations file.

A drawn run is an answers file (docs/rehearsal.md), which `m2pem simulate` replays.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from m2pem.campaign.distributions import Distribution, Draw, weighted
from m2pem.campaign.variations_file import (
    Arrival,
    Failure,
    VariationsModel,
    VariedBehavior,
    VariedLink,
    VariedService,
    read_model,
)
from m2pem.errors import AnswersError
from m2pem.findings import has_errors
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.yaml_source import YamlSource
from m2pem.mission.mission import Mission
from m2pem.rehearsal.answers import Answers, check_answers
from m2pem.rehearsal.answers_file import AnswersModel

Drawn = float | bool | str

MayHappen = Failure | Arrival | VariedLink

_DEGREES = ("deg", math.degrees(1))
_SHOWN: Mapping[str, tuple[str, float]] = {
    "from": _DEGREES,
    "wind_from": _DEGREES,
    "battery": ("%", 100),
    "duration_factor": ("times", 1),
    **dict.fromkeys(("wind", "max_speed", "cruise_speed", "climb_rate"), ("m/s", 1)),
}
"""By the last part of a name: the unit that people read, and its factor. Others are times, in s."""


def shown(name: str, value: float) -> str:
    """Return a number that was drawn, with its unit. `name`: as in `DrawnRun.values`."""
    unit, factor = _SHOWN.get(name.rpartition(".")[2], ("s", 1))
    return f"{factor * value:.4g} {unit}"


@dataclass(frozen=True, slots=True)
class DrawnRun:
    """One run that was drawn. `answers`: the content of its answers file; `values`: what was drawn
    for the first visit of each element, and for the whole run, by its name. `weight`: how many
    times as likely it is as it was drawn."""

    answers: dict[str, Any]
    values: dict[str, Drawn]
    weight: float = 1.0


class Variations:
    """What a campaign varies; made by `read_variations`."""

    def __init__(self, model: VariationsModel, source: YamlSource) -> None:
        self.model = model
        self.source = source

    @property
    def weighted(self) -> bool:
        """Whether anything is drawn with another probability than its own."""
        model = self.model
        tasks: list[VariedBehavior | VariedService] = []
        tasks += [*model.behaviors.values(), *model.services.values()]
        may_happen: list[MayHappen] = [*model.signals, *model.messages, *model.links]
        may_happen += [each.fails for each in tasks if each.fails is not None]
        return any(each.sampled is not None for each in may_happen)

    def draw(self, seed: int, run: int) -> DrawnRun:
        """Return what happens in one run. The same seed and run give the same."""
        return _Drawing(self.model, Draw(seed, run)).whole()

    def refuse_misfits(self, mission: Mission, fleet: Fleet) -> None:
        """Check that the mission and the fleet have all that is varied.

        Raises:
            AnswersError: with every finding, by the lines of the file.
        """
        drawing = _Drawing(self.model, Draw(0, 0), everything=True)
        answers = Answers(AnswersModel.model_validate(drawing.whole().answers), self.source)
        findings = check_answers(answers, mission, fleet)
        if has_errors(findings):
            raise AnswersError(f"{self.source.file} does not fit {mission.file}", findings)


def read_variations(said: Path | bytes) -> Variations:
    """Read a variations file, or its text (JSON, too).

    Raises:
        AnswersError: with every finding, each with its line.
    """
    return Variations(*read_model(said))


def _as_setting(key: str, value: float) -> float | str:
    return f"{value!r} rad" if key == "wind_from" else value


class _Drawing:
    """Draws one run. `everything`: also what comes with a probability only."""

    def __init__(
        self,
        model: VariationsModel,
        draw: Draw,
        *,
        everything: bool = False,
    ) -> None:
        self._model = model
        self._draw = draw
        self._everything = everything
        self._values: dict[str, Drawn] = {}
        self._weight = 1.0

    def whole(self) -> DrawnRun:
        model, visits = self._model, range(self._model.visits)
        answers: dict[str, Any] = {
            "answers": {
                element: [self._answer(element, weights, visit) for visit in visits]
                for element, weights in model.answers.items()
            },
            "services": {
                name: [self._service(name, varied, visit) for visit in visits]
                for name, varied in model.services.items()
            },
            "behaviors": {
                element: [self._behavior(element, varied, visit) for visit in visits]
                for element, varied in model.behaviors.items()
            },
            "signals": self._arrivals("signals", model.signals),
            "messages": self._arrivals("messages", model.messages),
            "vehicles": self._vehicles(),
        }
        if model.wind is not None:
            speed = self._number("wind", model.wind.speed)
            from_rad = self._number("wind.from", model.wind.from_)
            answers["wind"] = {"speed": speed, "from": f"{from_rad!r} rad"}
        content = {key: said for key, said in answers.items() if said}
        return DrawnRun(content, self._values, self._weight)

    def _number(self, key: str, distribution: Distribution, visit: int = 0) -> float:
        value = distribution.value(self._draw.share(key, visit))
        if visit == 0:
            self._values[key] = value
        return value

    def _happens(self, key: str, drawn: MayHappen, visit: int = 0) -> bool:
        probability, sampled = drawn.probability, drawn.sampled
        if sampled is None or visit > 0:
            sampled = probability
        happens = self._draw.share(key, visit) < sampled
        if sampled != probability:
            self._weight *= probability / sampled if happens else (1 - probability) / (1 - sampled)
        if visit == 0:
            self._values[key] = happens
        return happens or self._everything

    def _answer(
        self, element: str, weights: Mapping[str, float], visit: int
    ) -> str | dict[str, Any]:
        decision = self._decision(element, weights, visit)
        if element not in self._model.answer_times:
            return decision
        time = self._model.answer_times[element]
        return {
            "decision": decision,
            "after": self._number(f"answers.{element}.after", time, visit),
        }

    def _decision(self, element: str, weights: Mapping[str, float], visit: int) -> str:
        if self._everything:
            names = list(weights)
            return names[visit % len(names)]
        key = f"answers.{element}"
        decision = weighted(weights, self._draw.share(key, visit))
        if visit == 0:
            self._values[key] = decision
        return decision

    def _behavior(self, element: str, varied: VariedBehavior, visit: int) -> dict[str, Any]:
        key = f"behaviors.{element}"
        if (fails := varied.fails) and self._happens(f"{key}.fails", fails, visit):
            after_s = fails.after.value(self._draw.share(f"{key}.fails.after", visit))
            return {"after": after_s, "end": "failed", "error": fails.error}
        if varied.duration is not None:
            after_s = self._number(f"{key}.duration", varied.duration, visit)
            return {"after": after_s, "end": "succeeded"}
        if varied.duration_factor is not None:
            factor = self._number(f"{key}.duration_factor", varied.duration_factor, visit)
            return {"end": "simulated", "factor": factor}
        return {"end": "simulated"}

    def _service(self, name: str, varied: VariedService, visit: int) -> dict[str, Any]:
        key = f"services.{name}"
        if (fails := varied.fails) and self._happens(f"{key}.fails", fails, visit):
            after_s = fails.after.value(self._draw.share(f"{key}.fails.after", visit))
            return {"after": after_s, "error": fails.error}
        after_s = self._number(f"{key}.after", varied.after, visit)
        if not varied.write:
            return {"after": after_s}
        weights = {str(place): each.weight for place, each in enumerate(varied.write)}
        place = int(weighted(weights, self._draw.share(f"{key}.write", visit)))
        if visit == 0:
            self._values[f"{key}.write"] = json.dumps(varied.write[place].data, sort_keys=True)
        return {"after": after_s, "write": varied.write[place].data}

    def _arrivals(self, kind: str, arrivals: list[Arrival]) -> list[dict[str, Any]]:
        found = []
        for number, each in enumerate(arrivals):
            key = f"{kind}.{each.id}" + (f".{number}" if number else "")
            if self._happens(f"{key}.comes", each):
                at_s = self._number(f"{key}.at", each.at)
                found.append({"at": at_s, "id": each.id, "data": each.data})
        return found

    def _vehicles(self) -> dict[str, dict[str, Any]]:
        vehicles: dict[str, dict[str, Any]] = {
            vehicle: {
                key: _as_setting(key, self._number(f"vehicles.{vehicle}.{key}", distribution))
                for key, distribution in settings
                if distribution is not None
            }
            for vehicle, settings in self._model.vehicles.items()
        }
        for number, link in enumerate(self._model.links):
            key = f"links.{link.vehicle}" + (f".{number}" if number else "")
            if self._happens(f"{key}.lost", link):
                loss = {"at": self._number(f"{key}.at", link.at)}
                if link.for_ is not None:
                    loss["for"] = self._number(f"{key}.for", link.for_)
                vehicles.setdefault(link.vehicle, {}).setdefault("link_lost", []).append(loss)
        return vehicles
