"""The ways out that the refusals of a plan name: each is accepted when it is chosen."""

from collections import Counter
from collections.abc import Mapping

from m2pem.engine.revision import RevisionPlan, plan_revision
from m2pem.engine.state import RunState
from m2pem.mission.mission import Mission

MOST = 30
"""Ways out of a plan that are chosen."""


def check_ways_out(
    state: RunState, new: Mission, plan: RevisionPlan, moves: Mapping[str, str], now_us: int
) -> Counter[str]:
    """Choose each of them, up to a bound: thousands of tokens may be refused. Returns how many are
    to go elsewhere ("go"), and to end ("end")."""
    tried: Counter[str] = Counter()
    for refusal in plan.refusals:
        ways = [*refusal.candidates, *([""] if refusal.can_end else [])]
        assert refusal.token or not ways
        if refusal.can_end and refusal.element not in moves:
            assert refusal.text.endswith((", or end", "it can end")), refusal.text
        for way in ways:
            then = plan_revision(state, new, {**moves, refusal.element: way}, now_us)
            left = [each for each in then.refusals if each.token == refusal.token]
            assert not left, (refusal, way, left)
            assert refusal.token in {each.token for each in then.moves}
            tried["go" if way else "end"] += 1
        if tried.total() >= MOST:
            break
    return tried
