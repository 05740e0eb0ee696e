"""Authentication: WS-Security user name tokens with digests, and HTTP digest and basic."""

import base64
import binascii
import hashlib
import hmac
import re
import secrets
from collections.abc import Mapping
from datetime import UTC, datetime

from m2pem_plugin_ptz.simulator.onvif.camera import Account, Asks
from m2pem_plugin_ptz.simulator.onvif.soap import Element, FaultError

WINDOW_S = 10.0
"""Largest difference of the client's time from the camera's."""

REALM = "m2pem camera"


class TokenCheck:
    """Checks user name tokens. A nonce is accepted once within the window; after it, the time
    decides."""

    def __init__(self, account: Account) -> None:
        self._account = account
        self._nonces: dict[bytes, float] = {}

    def check(self, header: Element | None, now_s: float) -> None:
        """Check a token.

        Raises:
            FaultError: it may not; the text says why.
        """
        token = header.child("Security", "UsernameToken") if header is not None else None
        if token is None:
            raise _unauthorized("there is no user name token")
        password = token.child("Password")
        if password is None or not password.attribute("Type").endswith("#PasswordDigest"):
            raise _unauthorized("the password is not a digest")
        created, nonce = token.says("Created"), _decoded(token.says("Nonce"))
        expected = hashlib.sha1(
            nonce + created.encode() + self._account.password.encode(), usedforsecurity=False
        ).digest()
        same_user = token.says("Username") == self._account.user
        if not hmac.compare_digest(_decoded(password.text), expected) or not same_user:
            raise _unauthorized("the user or the password is wrong")
        if abs(_seconds(created) - now_s) > WINDOW_S:
            raise _unauthorized("the token was not made now")
        self._nonces = {key: at for key, at in self._nonces.items() if now_s - at < 2 * WINDOW_S}
        if nonce in self._nonces:
            raise _unauthorized("the nonce was used before")
        self._nonces[nonce] = now_s


class HttpCheck:
    """Checks HTTP authorization, digest (MD5, `auth`) or basic."""

    def __init__(self, account: Account, asks: Asks) -> None:
        self._account, self._asks = account, asks
        self._nonces: dict[str, int] = {}

    def challenge(self) -> str:
        """Return the challenge for a client that does not pass."""
        if self._asks is Asks.BASIC:
            return f'Basic realm="{REALM}"'
        nonce = secrets.token_hex(16)
        self._nonces[nonce] = 0
        return f'Digest realm="{REALM}", qop="auth", algorithm=MD5, nonce="{nonce}"'

    def passes(self, method: str, target: str, authorization: str) -> bool:
        """Return whether the authorization is that of the account."""
        scheme, _, rest = authorization.partition(" ")
        if self._asks is Asks.BASIC:
            expected = f"{self._account.user}:{self._account.password}".encode()
            return scheme.lower() == "basic" and hmac.compare_digest(_decoded(rest), expected)
        if scheme.lower() != "digest":
            return False
        pairs = re.findall(r'(\w+)=(?:"([^"]*)"|([^\s,]+))', rest)
        return self._digest_passes(method, target, {key: one or two for key, one, two in pairs})

    def _digest_passes(self, method: str, target: str, said: Mapping[str, str]) -> bool:
        nonce, count = said.get("nonce", ""), said.get("nc", "")
        if nonce not in self._nonces or said.get("uri") != target:
            return False
        if not re.fullmatch("[0-9a-f]{8}", count) or int(count, 16) <= self._nonces[nonce]:
            return False  # said before
        one = _md5(f"{self._account.user}:{REALM}:{self._account.password}")
        two = _md5(f"{method}:{target}")
        whole = f"{one}:{nonce}:{count}:{said.get('cnonce', '')}:{said.get('qop', '')}:{two}"
        if said.get("username") != self._account.user:
            return False
        if not hmac.compare_digest(said.get("response", ""), _md5(whole)):
            return False
        self._nonces[nonce] = int(count, 16)
        return True


def _md5(text: str) -> str:
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def _decoded(text: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        return b""


def _seconds(created: str) -> float:
    try:
        moment = datetime.fromisoformat(created)
    except ValueError:
        raise _unauthorized(f"{created!r} is no time") from None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def _unauthorized(why: str) -> FaultError:
    return FaultError(f"Sender not authorized: {why}", "NotAuthorized")
