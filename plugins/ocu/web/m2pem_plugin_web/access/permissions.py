"""Which role a request needs: dependencies of FastAPI that give a router the user who asks.

They are apart from the roles themselves, which the command line reads without loading FastAPI.
"""

from collections.abc import Callable
from typing import Annotated

from fastapi import Depends
from fastapi.requests import HTTPConnection
from starlette.exceptions import HTTPException

from m2pem_plugin_web.access.requests import refuse_late
from m2pem_plugin_web.access.roles import Person, Role

SCOPE_KEY = "m2pem.person"
"""Where the guard puts who asks, in the ASGI scope of a connection."""


def person_of(connection: HTTPConnection) -> Person | None:
    """Return the user of a connection; None: they have not signed in."""
    person = connection.scope.get(SCOPE_KEY)
    return person if isinstance(person, Person) else None


def needs(role: Role, *, however_late: bool = False) -> Callable[[HTTPConnection], Person]:
    """A dependency of FastAPI: the person who asks, if their role covers `role`.

    It is resolved when the body of a request is complete. A command that arrives too late by then
    is refused, but not if `however_late`.
    """

    def person(connection: HTTPConnection) -> Person:
        found = person_of(connection)
        if found is None:
            raise HTTPException(401, "sign in first")
        if not found.role.covers(role):
            raise HTTPException(403, f"this needs the role {role}; {found.name} is {found.role}")
        if not however_late:
            refuse_late(connection)
        return found

    return person


Viewer = Annotated[Person, Depends(needs(Role.VIEWER))]
Operator = Annotated[Person, Depends(needs(Role.OPERATOR))]
Stopper = Annotated[Person, Depends(needs(Role.OPERATOR, however_late=True))]
Commander = Annotated[Person, Depends(needs(Role.COMMANDER))]
