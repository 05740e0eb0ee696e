"""What the simulation remembers: behaviors and effects, in bounds, and in a file if wanted."""

from collections import deque
from collections.abc import Mapping

from m2pem.api.arbiter import BehaviorId
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.effects import Effect, EffectKind
from m2pem.simulation.executions import Body, Execution
from m2pem.simulation.statefile import REMEMBERED, StateFile

REMEMBERED_EFFECTS = 10_000


class Memory:
    """`files`: where the state of each resource is kept; those that are missing die with us."""

    def __init__(self) -> None:
        self.effects: deque[Effect] = deque(maxlen=REMEMBERED_EFFECTS)
        self.executions: dict[BehaviorId, Execution] = {}
        self.files: Mapping[ResourceId, StateFile] = {}
        self._unsaved: list[Effect] = []

    def register(self, execution: Execution) -> None:
        """Know a behavior from now on, as the newest."""
        self.executions.pop(execution.id, None)
        self.executions[execution.id] = execution
        if len(self.executions) > REMEMBERED:
            ended = (key for key, kept in self.executions.items() if kept.ended)
            oldest = next(ended, None)
            if oldest is not None:
                del self.executions[oldest]

    def note(self, effect: Effect) -> None:
        """Remember an effect."""
        self.effects.append(effect)
        self._unsaved.append(effect)

    def note_of(self, execution: Execution, kind: EffectKind, now_us: int) -> None:
        """Remember an effect of a behavior."""
        self.note(Effect(now_us, kind, execution.resources[0], execution.id))

    def save(self, execution: Execution | None, *bodies: Body) -> None:
        """Keep a behavior, its bodies and more, with the effects noted since."""
        effects, self._unsaved = self._unsaved, []
        if not self.files:
            return
        parts = execution.parts if execution is not None else []
        all_bodies = {body.id: body for body in (*(part.body for part in parts), *bodies)}
        home = None
        if execution is not None and execution.resources:
            home = self.files.get(execution.resources[0])
        for file in dict.fromkeys(self.files.values()):
            changed = [body for body in all_bodies.values() if self.files.get(body.id) is file]
            noted = [effect for effect in effects if self.files.get(effect.resource) is file]
            kept = execution if file is home else None
            if changed or noted or kept:
                file.save(changed, kept, noted)
