"""How one gets in: a one-time token, or a name with its password; and who a cookie stands for."""

from collections.abc import Mapping

from m2pem_plugin_web.access.people import Person, Role
from m2pem_plugin_web.access.sessions import Sessions
from m2pem_plugin_web.access.tokens import OneTimeToken


class Entry:
    """`token` signs `owner` in, who started the executive; there is none where there are users.

    `port` is part of the cookie's name: browsers do not tell the ports of a machine apart.
    """

    def __init__(self, port: int, *, secure: bool, owner: Person | None) -> None:
        self.cookie = f"m2pem_{port}"
        self.secure = secure
        self.sessions = Sessions()
        self.token = OneTimeToken() if owner is not None else None
        self._owner = owner

    def redeem(self, token: str) -> str | None:
        """The key of a new session for who has the token; None: it is not the token."""
        if self.token is None or self._owner is None or not self.token.redeem(token):
            return None
        return self.sessions.begin(self._owner.name)

    def person(self, cookies: Mapping[str, str]) -> Person | None:
        """Who asks, by the cookies of their browser."""
        key = cookies.get(self.cookie)
        session = self.sessions.find(key) if key else None
        if session is None:
            return None
        return self._owner if self._owner and self._owner.name == session.name else None


def owner_of(name: str) -> Person:
    """Who started the executive may do everything."""
    return Person(name, Role.COMMANDER)
