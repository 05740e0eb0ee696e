"""What runs and behaviors are called outside of this process, where journals are not known."""

from uuid import UUID, uuid5

from m2pem.api import BehaviorId


def goal_id(journal: UUID, behavior: BehaviorId) -> UUID:
    """The goal of a behavior: the same after a restart, and unlike that of any other journal."""
    return uuid5(journal, behavior)


def run_id(journal: UUID, behavior: BehaviorId) -> UUID:
    """The run that a behavior belongs to: "r1.b3" is of run "r1"."""
    return uuid5(journal, behavior.partition(".")[0])
