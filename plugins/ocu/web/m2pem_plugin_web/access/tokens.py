"""The one-time token: who opens the address that has it, is signed in."""

import hmac
import secrets
from collections.abc import Callable

TOKEN_BYTES = 24


class OneTimeToken:
    """There is always one that was not used. `renewed` is told of each."""

    def __init__(self, renewed: Callable[[str], None] = lambda _: None) -> None:
        self._renewed = renewed
        self._token = ""
        self._renew()

    @property
    def value(self) -> str:
        """The token that signs in the next one who has it."""
        return self._token

    def redeem(self, token: str) -> bool:
        """Whether this was the token; if so, it is none any more."""
        if not hmac.compare_digest(token.encode(), self._token.encode()):
            return False
        self._renew()
        return True

    def _renew(self) -> None:
        self._token = secrets.token_urlsafe(TOKEN_BYTES)
        self._renewed(self._token)
