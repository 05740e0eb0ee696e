"""Roles of users, and users who have signed in."""

from dataclasses import dataclass
from enum import StrEnum


class Role(StrEnum):
    """A role may do all that those before it may."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    COMMANDER = "commander"

    def covers(self, other: "Role") -> bool:
        """Whether this role may do what `other` may."""
        order = list(Role)
        return order.index(self) >= order.index(other)


@dataclass(frozen=True, slots=True)
class Person:
    """A user who has signed in; `name` is journaled with what they do."""

    name: str
    role: Role
