"""Who asks, and what they may do: a router names the least role that each of its routes needs."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from fastapi import Depends
from fastapi.requests import HTTPConnection
from starlette.exceptions import HTTPException

SCOPE_KEY = "m2pem.person"
"""Where the guard puts who asks, in the ASGI scope of a connection."""


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
    """Somebody who has signed in; `name` is journaled with what they do."""

    name: str
    role: Role


def person_of(connection: HTTPConnection) -> Person | None:
    """Who asks; None: somebody who has not signed in."""
    person = connection.scope.get(SCOPE_KEY)
    return person if isinstance(person, Person) else None


def needs(role: Role) -> Callable[[HTTPConnection], Person]:
    """A dependency of FastAPI: the person who asks, if their role covers `role`."""

    def person(connection: HTTPConnection) -> Person:
        found = person_of(connection)
        if found is None:
            raise HTTPException(401, "sign in first")
        if not found.role.covers(role):
            raise HTTPException(403, f"this needs the role {role}; {found.name} is {found.role}")
        return found

    return person


Viewer = Annotated[Person, Depends(needs(Role.VIEWER))]
Operator = Annotated[Person, Depends(needs(Role.OPERATOR))]
Commander = Annotated[Person, Depends(needs(Role.COMMANDER))]
