"""Revisions: a run goes on with a new version of its mission (docs/revising.md).

`plan_revision` says what becomes of each token, and of all that it does and waits for, and what is
refused. An input `Revise` is decided by making the plan again: it is carried out only if it is the
plan that was shown.
"""

from m2pem.engine.revision.carrying_out import revise
from m2pem.engine.revision.plan import (
    Adjustment,
    Arming,
    Effect,
    EffectKind,
    Move,
    Refusal,
    RevisionPlan,
)
from m2pem.engine.revision.planning import plan_revision

__all__ = [
    "Adjustment",
    "Arming",
    "Effect",
    "EffectKind",
    "Move",
    "Refusal",
    "RevisionPlan",
    "plan_revision",
    "revise",
]
