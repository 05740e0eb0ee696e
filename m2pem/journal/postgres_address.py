"""The address of a journal in PostgreSQL: its URL, and the file beside which others are kept.

What an executive keeps on its own host (its control socket, marks, the state of simulated vehicles)
is found without the database, so that `m2pem stop` reaches an executive whose database is down. It
is beside a small file that has the URL without its password, and whose path names the journal, too.
"""

import getpass
import hashlib
import os
import re
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qsl, quote, unquote, urlencode, urlsplit

from m2pem.errors import JournalError, JournalUrlError
from m2pem.whole_file import write_whole

SUFFIX = ".postgresql"
SCHEMES = ("postgresql", "postgres")
_SECRET = ("password", "sslpassword")
_IN_URL = re.compile(r"(\b[a-z][a-z0-9+.-]*://[^\s:@/?]*):[^\s@/]*@")
_IN_QUERY = re.compile(r"\b((?:ssl)?password=)[^\s&'\"]*")


@dataclass(frozen=True, slots=True)
class PostgresAddress:
    """`url`: as libpq takes it, with a password if it has one. `shown`: without one."""

    url: str
    shown: str
    file: Path


def address_of(url: str, folder: Path) -> PostgresAddress:
    """Return the address that a URL names; its file is in `folder`.

    Raises:
        JournalUrlError: it is no URL of a database.
    """
    try:
        parts = urlsplit(url)
        query = dict(parse_qsl(parts.query, strict_parsing=bool(parts.query)))
    except ValueError as error:
        raise _no_url(url, str(error)) from error
    if parts.fragment or parts.path.count("/") > 1:
        raise _no_url(url, "after the host comes the name of one database")
    user, _, hosts = parts.netloc.rpartition("@")
    user = unquote(user.partition(":")[0]) or query.get("user", "")
    service = query.get("service") or os.environ.get("PGSERVICE", "")
    host = unquote(hosts) or query.get("host") or os.environ.get("PGHOST", "")
    port = query.get("port") or os.environ.get("PGPORT", "")
    database = unquote(parts.path.strip("/")) or query.get("dbname")
    database = database or os.environ.get("PGDATABASE") or ("" if service else user or _me())
    # What names a server by default is the same as what says so.
    where = re.sub(r":5432\b", "", host if ":" in host or not port else f"{host}:{port}")
    key = "\n".join((service, where, database, query.get("options", "")))
    readable = re.sub(r"[^A-Za-z0-9.]+", "-", f"{service} {where} {database}").strip("-.")
    name = f"{readable[:80]}-{hashlib.sha256(key.encode()).hexdigest()[:8]}{SUFFIX}"
    return PostgresAddress(url, without_password(url), folder / name)


def read_address(file: Path) -> PostgresAddress:
    """Return the address that a file names; see `write_address`.

    Raises:
        JournalError: the file cannot be read, or has no URL.
    """
    try:
        url = file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise JournalError(f"{file} cannot be read: {error}") from error
    if urlsplit(url).scheme not in SCHEMES:
        raise JournalUrlError(f"{file} does not have the URL of a journal in PostgreSQL")
    return PostgresAddress(url, without_password(url), file)


def write_address(address: PostgresAddress) -> None:
    """Write the file of an address, for its owner alone. It has no password.

    Raises:
        JournalError: it cannot be written.
    """
    content = f"{address.shown}\n".encode()
    try:
        if address.file.exists() and address.file.read_bytes() == content:
            return
        write_whole(address.file, content)
    except OSError as error:
        raise JournalError(f"{address.file} cannot be written: {error.strerror}") from error


def without_password(text: str) -> str:
    """Return a text, such as a command line, without the passwords of databases in it."""
    if text.startswith(tuple(f"{scheme}://" for scheme in SCHEMES)):
        return _url_without_password(text)
    return _IN_QUERY.sub(r"\1...", _IN_URL.sub(r"\1@", text))


def _url_without_password(url: str) -> str:
    parts = urlsplit(url)
    user, at, hosts = parts.netloc.rpartition("@")
    query = [each for each in parse_qsl(parts.query) if each[0] not in _SECRET]
    netloc = f"{user.partition(':')[0]}{at}{hosts}"
    return parts._replace(netloc=netloc, query=urlencode(query, quote_via=quote)).geturl()


def _me() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return ""


def _no_url(url: str, why: str) -> JournalUrlError:
    return JournalUrlError(
        f"{without_password(url)} is not the URL of a journal in PostgreSQL ({why}): write "
        "postgresql://user@host/database; the password is in ~/.pgpass"
    )
