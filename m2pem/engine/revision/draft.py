"""A plan of a revision in the making."""

from collections.abc import Collection, Mapping

from m2pem.engine.revision.plan import (
    Adjustment,
    Arming,
    Effect,
    EffectKind,
    Move,
    Refusal,
    RevisionPlan,
)
from m2pem.engine.revision.targets import candidates, moved_with, way_out
from m2pem.engine.state import RunState, Scope, Token, Wait
from m2pem.mission.difference import Difference, difference
from m2pem.mission.elements import Container
from m2pem.mission.mission import Mission, version_of


class PlanDraft:
    """What was found so far. `adjustable`: behaviors whose speed can change while they go on."""

    def __init__(
        self,
        state: RunState,
        new: Mission,
        moves: Mapping[str, str],
        adjustable: Collection[str] = (),
    ) -> None:
        self.adjustable = adjustable
        self.difference: Difference = difference(state.mission, new)
        self._versions = version_of(new), version_of(state.mission)
        self._requested = dict(moves)
        self._effects: list[Effect] = []
        self._refusals: dict[Refusal, None] = {}  # several instances have the same one
        self._moves: list[Move] = []
        self._restarted: list[int] = []
        self._adjustments: list[Adjustment] = []
        self._disarmed: list[int] = []
        self._armings: list[Arming] = []
        self._rechecked: list[int] = []

    def add(self, kind: EffectKind, element: str, token: int, text: str) -> None:
        """Add what the revision does."""
        self._effects.append(Effect(kind, element, token, text))

    def refuse(self, element: str, text: str, token: int = 0) -> None:
        """Add why the revision cannot be, where the way out is another one than moving a token."""
        self._refuse(Refusal(element, token, text))

    def refuse_token(self, token: Token, why: str, container: Container) -> None:
        """Add why a token cannot be on its element in the new version, and where it can go.

        `container`: that of the token's scope in the new version.
        """
        moved = moved_with(token)
        there = candidates(moved, container)
        self._refuse(_refusal_of(moved, f"{why}: {way_out(moved, there)}", there))

    def refuse_move(self, token: Token, why: str, container: Container) -> None:
        """Add why a token cannot go where it is to go. `why` says where it can."""
        self._refuse(_refusal_of(token, why, candidates(token, container)))

    def _refuse(self, refusal: Refusal) -> None:
        self._refusals[refusal] = None

    def move(self, move: Move) -> None:
        """Have a token leave its element."""
        self._moves.append(move)

    def restart(self, token: Token) -> None:
        """Have the task of a token begin again."""
        self._restarted.append(token.id)

    def adjust(self, adjustment: Adjustment) -> None:
        """Have a behavior go on with other parameters."""
        self._adjustments.append(adjustment)

    def disarm(self, wait: Wait) -> None:
        """Have an event awaited no longer."""
        self._disarmed.append(wait.id)

    def arm(self, arming: Arming) -> None:
        """Have an event awaited."""
        self._armings.append(arming)

    def recheck(self, scope: Scope) -> None:
        """Have an ad-hoc subprocess choose, or ask, again."""
        self._rechecked.append(scope.id)

    @property
    def is_unchanged(self) -> bool:
        """Whether the run has this version already."""
        version, previous = self._versions
        return version == previous

    def finish(self) -> RevisionPlan:
        """Return the plan."""
        version, previous = self._versions
        return RevisionPlan(
            version,
            previous,
            self._requested,
            self.difference,
            tuple(self._effects),
            tuple(self._refusals),
            tuple(self._moves),
            tuple(self._restarted),
            tuple(self._adjustments),
            tuple(self._disarmed),
            tuple(self._armings),
            tuple(self._rechecked),
        )


def _refusal_of(token: Token, text: str, there: tuple[str, ...]) -> Refusal:
    """Return the refusal of a token that can go to some elements, and end unless it undoes one."""
    return Refusal(token.node.id, token.id, text, there, token.compensates is None)
