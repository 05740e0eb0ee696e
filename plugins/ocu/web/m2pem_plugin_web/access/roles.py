"""Roles of users, and users who have signed in."""

from dataclasses import dataclass
from enum import StrEnum


class Role(StrEnum):
    """A role has all permissions of the roles before it."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    COMMANDER = "commander"

    def covers(self, other: "Role") -> bool:
        """Return whether this role has all permissions of `other`."""
        order = list(Role)
        return order.index(self) >= order.index(other)


@dataclass(frozen=True, slots=True)
class Person:
    """A user who has signed in; `name` is journaled with the user's commands."""

    name: str
    role: Role
