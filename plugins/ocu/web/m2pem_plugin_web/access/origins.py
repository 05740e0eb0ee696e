"""Which pages may send requests here: none but our own, under a name that we are known by.

The name in Host stops rebinding of DNS, where a foreign name comes to mean this machine. Origin
stops foreign pages, for which a browser would send the cookie along. Ports of one machine are the
same site to browsers, so that SameSite alone would let another program's page pass.
"""

from collections.abc import Collection

from starlette.datastructures import Headers

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
OWN_SITES = frozenset({"same-origin", "none"})
"""Of Sec-Fetch-Site; `none`: somebody has typed the address."""


def name_of(host: str) -> str:
    """The name in a Host header: without the port, and without the brackets of IPv6."""
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    return host.partition(":")[0].lower()


def wrong_host(headers: Headers, names: Collection[str]) -> str:
    """Why the Host header is refused; "": it is not."""
    hosts = headers.getlist("host")
    if len(hosts) != 1:
        return "a request has one Host header"
    if name_of(hosts[0]) not in names:
        return f"this page is not called {name_of(hosts[0])[:100]!r} here"
    return ""


def foreign(headers: Headers, scheme: str, *, strict: bool) -> str:
    """Why a request may come from a foreign page; "": it does not.

    `strict`: it changes something or opens a WebSocket, so that a browser says its origin.
    """
    site = headers.get("sec-fetch-site")
    if site is not None and site not in OWN_SITES:
        return "the request comes from another site"
    origins = headers.getlist("origin")
    own = f"{scheme}://{headers.get('host', '')}".lower()
    if not origins:
        return f"the request needs the header Origin: {own}" if strict else ""
    if [each.lower() for each in origins] != [own]:
        return "the request comes from another page"
    return ""
