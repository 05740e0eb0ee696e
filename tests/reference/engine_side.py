"""The engine as the comparison sees it: the same inputs, and the same things seen."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from m2pem.bpmn import parse_mission
from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.run import MissionRun
from m2pem.engine.state import RunState
from m2pem.mission.mission import Mission
from tests.engine.invariants import check_state
from tests.reference.diagram import Level
from tests.reference.interpreter import Input, Seen
from tests.reference.xml_of import DONE, xml_of

_NOW_US = 1_767_225_600_000_000
_BATCH = 2_000  # steps: more than any reaction has that the reference follows to its end


@dataclass(frozen=True, slots=True)
class Played:
    """A run after some inputs: its records alone, from which it is rebuilt to go on."""

    records: tuple[r.Record, ...]
    seen: Seen
    prompts: tuple[tuple[str, str], ...]  # open prompts: id, task


class Engine:
    """Plays one model in the engine."""

    def __init__(self, model: Level) -> None:
        self.mission: Mission = parse_mission(xml_of(model).encode(), "model.bpmn")

    def begin(self) -> Played:
        return self._play((), i.StartRun("MAIN"))

    def choices(self, played: Played, given: Input) -> list[Played]:
        """What an input leads to, one for each open prompt that the answer may be meant for."""
        if given.kind == "signal":
            return [self._play(played.records, i.SignalReceived(given.name))]
        return [
            self._play(played.records, i.PromptAnswer(prompt, given.value or DONE))
            for prompt, task in played.prompts
            if task == given.name
        ]

    def _play(self, before: tuple[r.Record, ...], item: i.Input) -> Played:
        run = MissionRun(self.mission, None, "r1", _BATCH)
        run.replay(before)
        step = run.receive(item, _NOW_US)
        check_state(run.state)
        prompts = tuple((p.id, p.token.node.id) for p in run.state.prompts.values())
        return Played((*before, *step.records), _seen(run.state, step.records), prompts)


def _seen(state: RunState, records: Sequence[r.Record]) -> Seen:
    taken = Counter(record.flow for record in records if isinstance(record, r.FlowTaken))
    flows = tuple(sorted(taken.items()))
    if state.outcome is not None:
        stuck = state.detail.startswith("stuck")
        return Seen(flows, (), (), "stuck" if stuck else state.outcome.value)
    if state.yielded:
        return Seen(flows, (), (), "endless")
    prompts = Counter(prompt.token.node.id for prompt in state.prompts.values())
    signals = {wait.ref for wait in state.waits.values() if wait.trigger is r.Trigger.SIGNAL}
    return Seen(flows, tuple(sorted(prompts.items())), tuple(sorted(signals)), None)
