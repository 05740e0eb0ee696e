"""What comes after a choice or a revision, under every answer and order where that is little."""

import copy
import sys
from collections.abc import Iterator
from contextlib import suppress
from random import Random

from m2pem.engine import inputs as i
from m2pem.engine.incidents import move_targets
from m2pem.engine.resolving import why_refused
from m2pem.engine.revision import plan_revision
from m2pem.engine.run import MissionRun
from m2pem.engine.state import BehaviorPhase, RunStatus
from m2pem.engine.throwing import catcher_of_error
from m2pem.errors import MissionError
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import ErrorPolicy
from m2pem.mission.values import Value
from m2pem.verify.outlook import Outlook, OutlookLimits, outlook
from tests.engine.invariants import check_state
from tests.engine.kit import Play
from tests.engine.random_play import RandomPlay
from tests.engine.random_revisions import changed
from tests.verify.random_outlooks import for_outlook

LIMITS = OutlookLimits(states=100, seconds=1e9)
MOST_INPUTS = 40
FEW_PLAYS = 40
"""So many states are played on from, all that follow; else random plays."""
PLAYS = 4

GOOD, BAD, OPEN = "completes", "does not complete", "is not over"


def copied(run: MissionRun) -> MissionRun:
    """A copy; processes that call themselves may be nested deep."""
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(50_000)
    try:
        return copy.deepcopy(run)
    finally:
        sys.setrecursionlimit(limit)


class Case:
    """A random run before a choice or a revision. `choice` None: there is none to make."""

    def __init__(self, dice: Random) -> None:
        Play.made.clear()
        self._dice = dice
        on_error = dice.choice((ErrorPolicy.END, ErrorPolicy.INCIDENT, ErrorPolicy.INCIDENT))
        game = RandomPlay(for_outlook(dice), 100, on_error)
        game.go([dice.randrange(10_000) for _ in range(dice.randrange(8))])
        if dice.random() < 0.7:  # else messages may bring it, so that little is known
            game.give(i.SetData({"c": dice.randrange(2)}))
        self.run, self.now_us, self.fleet = game.play.run, game.play.now_us, game.play.fleet
        self.game = game
        self.choice: i.ResolveIncident | i.Revise | None = None
        if self.run.state.status is RunStatus.ENDED or self.run.wants_continue:
            return
        if on_error is ErrorPolicy.INCIDENT:
            self._fail_something()
        if self.run.state.status is RunStatus.ENDED:
            return
        if self.run.state.incidents and dice.random() < 0.7:
            self.choice = self._about_an_incident()
        else:
            self.choice = self._revision()

    def _fail_something(self) -> None:
        for behavior in list(self.run.state.behaviors.values()):
            if behavior.phase is BehaviorPhase.ACTIVE and self._dice.random() < 0.5:
                failed = BehaviorState.FAILED
                self.game.give(i.BehaviorReported(behavior.id, behavior.number + 1, failed))

    def _about_an_incident(self) -> i.ResolveIncident | None:
        dice, state = self._dice, self.run.state
        incident = dice.choice(list(state.incidents.values()))
        choice = dice.choice([each for each in incident.choices if each != "retry_with"])
        to = ""
        data: dict[str, Value] = {}
        if choice is i.IncidentChoice.MOVE:
            targets = list(move_targets(incident.token))
            if not targets:
                return None
            to = dice.choice(targets).id
        if choice is i.IncidentChoice.SET_DATA:
            data = {"a": dice.randrange(3), "b": dice.randrange(3)}
        item = i.ResolveIncident(incident.id, choice, "ann", data, to)
        return None if why_refused(state, self.fleet, item) else item

    def _revision(self) -> i.Revise | None:
        dice, state = self._dice, self.run.state
        new = changed(state.mission.source, dice)
        if new is None:
            return None
        moves: dict[str, str] = {}
        if state.tokens and dice.random() < 0.2:
            token = dice.choice(list(state.tokens.values()))
            moves[token.node.id] = dice.choice(list(new.elements))
        for _ in range(4):
            plan = plan_revision(state, new, moves, self.now_us)
            if not plan.refusals:
                break
            for refusal in plan.refusals:
                if refusal.token and refusal.element not in moves:
                    moves[refusal.element] = dice.choice((*refusal.candidates[:3], ""))
                else:
                    moves.pop(refusal.element, None)
        if plan.refusals or plan.version == plan.previous:
            return None
        return i.Revise(plan.version, "new.bpmn", new.source, plan.digest, moves=moves, by="ann")

    @classmethod
    def drawn(cls, dice: Random) -> "Case":
        """A case with a choice: missions that are wrong or have ended are drawn again."""
        while True:
            with suppress(MissionError):
                case = cls(dice)
                if case.choice is not None:
                    return case

    def foreseen(self) -> Outlook:
        assert self.choice is not None
        return outlook(copied(self.run), self.now_us, self.choice, LIMITS)

    def begun(self) -> "Playing | None":
        """What follows the choice. None: a loop does not wait."""
        assert self.choice is not None
        before = frozenset(self.run.state.incidents)
        playing = Playing(copied(self.run), self.now_us, self.fleet, before)
        playing.give(self.choice)
        playing.give(i.SetBreakpoints())
        if playing.run.state.status is RunStatus.PAUSED:
            playing.give(i.ResumeRun())
        return None if playing.run.wants_continue else playing


class Playing:
    """A run that goes on. `before`: the incidents that were open before the choice."""

    def __init__(self, run: MissionRun, now_us: int, fleet: Fleet, before: frozenset[str]) -> None:
        self.run, self.now_us, self.fleet, self.before = run, now_us, fleet, before
        self.undecided = False
        """An incident that was open before was tried again, and did not get on."""

    def copy(self) -> "Playing":
        return Playing(copied(self.run), self.now_us, self.fleet, self.before)

    def give(self, item: i.Input) -> None:
        self.run.receive(item, self.now_us)
        check_state(self.run.state)
        for _ in range(3):
            if self.run.wants_continue:
                self.run.receive(i.Continue(), self.now_us)

    @property
    def end(self) -> str:
        """How it has ended; "": it has not."""
        state = self.run.state
        if state.status is RunStatus.ENDED:
            return GOOD if state.outcome in ("completed", "terminated") else BAD
        return OPEN if self.run.wants_continue or self.undecided else ""

    def things(self) -> list[i.Input]:
        """What may come, as docs/incidents.md says."""
        state = self.run.state
        found: list[i.Input] = []
        for behavior in state.behaviors.values():
            number = behavior.number + 1
            if behavior.phase is BehaviorPhase.CANCELLING:
                cancelled = BehaviorState.CANCELLED
                found.append(i.BehaviorReported(behavior.id, number, cancelled))
            elif behavior.phase is BehaviorPhase.ACTIVE:
                done, failed = BehaviorState.SUCCEEDED, BehaviorState.FAILED
                found.append(i.BehaviorReported(behavior.id, number, done))
                token = state.tokens[behavior.token]
                found += [
                    i.BehaviorReported(behavior.id, number, failed, code)
                    for code in ("FAILED", "E1", "E2")
                    if catcher_of_error(token, code) is not None
                ]
        for prompt in state.prompts.values():
            found += [i.PromptAnswer(prompt.id, each["value"]) for each in prompt.decisions]
        for service in state.services:
            found.append(i.ServiceCompleted(service))
        for kind, ref in state.catchers:
            of_kind = i.SignalReceived if kind == "signal" else i.MessageReceived
            found.append(of_kind(ref))
        for incident in state.incidents.values():
            if incident.id in self.before:
                choices = [i.IncidentChoice.SKIP, i.IncidentChoice.RETRY]
                found += [
                    i.ResolveIncident(incident.id, each)
                    for each in choices
                    if each in incident.choices
                ]
        if self.run.next_due_us is not None:
            found.append(i.Tick())
        return found

    def take(self, item: i.Input, dice: Random | None = None) -> None:
        """Have a thing come: now, or at a random time before the next timer."""
        due_us = self.run.next_due_us
        if isinstance(item, i.Tick):
            assert due_us is not None
            self.now_us = max(self.now_us, due_us)
        elif dice is not None and (due_us or 0) > self.now_us + 1 and dice.random() < 0.3:
            self.now_us = dice.randrange(self.now_us, due_us or 0)
        opened = set(self.run.state.incidents)
        resolved = item.incident if isinstance(item, i.ResolveIncident) else ""
        at = self.run.state.incidents[resolved].token if resolved else None
        self.give(item)
        news = [each for each in self.run.state.incidents.values() if each.id not in opened]
        self.undecided = at is not None and any(each.token.node is at.node for each in news)

    def ends(self, dice: Random) -> Iterator[str]:
        """Yield how it ends: all ways where there are few, else some."""
        found = list(self._all_ends())
        if OPEN not in found:
            yield from found
            return
        yield OPEN
        for _ in range(PLAYS):
            played = self.copy()
            for _ in range(MOST_INPUTS):
                if played.end:
                    break
                things = played.things()
                if not things:
                    break
                played.take(dice.choice(things), dice)
            yield played.end or (BAD if not played.things() else OPEN)

    def _all_ends(self) -> Iterator[str]:
        waiting, number = [self.copy()], 0
        while waiting:
            number += 1
            playing = waiting.pop()
            if number > FEW_PLAYS:
                yield OPEN
                return
            if playing.end:
                yield playing.end
                continue
            things = playing.things()
            if not things:
                yield BAD
            for item in things:
                following = playing.copy()
                following.take(item)
                waiting.append(following)
