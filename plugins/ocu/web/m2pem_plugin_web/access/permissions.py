"""The role that a request needs: FastAPI dependencies that return the user of a request.

The roles are in another module: the command line imports them without FastAPI.
"""

from collections.abc import Callable
from typing import Annotated

from fastapi import Depends
from fastapi.requests import HTTPConnection
from starlette.exceptions import HTTPException

from m2pem_plugin_web.access.requests import refuse_late
from m2pem_plugin_web.access.roles import Person, Role

SCOPE_KEY = "m2pem.person"
"""The key of the user in the ASGI scope of a connection, set by the guard."""


def person_of(connection: HTTPConnection) -> Person | None:
    """Return the user of a connection; None: the user has not signed in."""
    person = connection.scope.get(SCOPE_KEY)
    return person if isinstance(person, Person) else None


def needs(role: Role, *, however_late: bool = False) -> Callable[[HTTPConnection], Person]:
    """Return a FastAPI dependency: the user of a request, if the user's role covers `role`.

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
