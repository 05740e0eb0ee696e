"""Revisions: a run goes on with a new version of its mission (docs/revising.md).

`plan_revision` says what becomes of each token, and of all that it does and waits for, and what is
refused. An input `Revise` is decided by making the plan again: it is carried out only if it is the
plan that was shown.
"""

from m2pem.engine.revision.carrying_out import revise as revise
from m2pem.engine.revision.plan import Adjustment as Adjustment
from m2pem.engine.revision.plan import Arming as Arming
from m2pem.engine.revision.plan import Effect as Effect
from m2pem.engine.revision.plan import EffectKind as EffectKind
from m2pem.engine.revision.plan import Move as Move
from m2pem.engine.revision.plan import Refusal as Refusal
from m2pem.engine.revision.plan import RevisionPlan as RevisionPlan
from m2pem.engine.revision.planning import plan_revision as plan_revision
