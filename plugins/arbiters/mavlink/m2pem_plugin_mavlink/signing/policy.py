"""What a fleet file says about the signatures of a vehicle's frames."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from m2pem.api import ConnectionReader

FIRST_LINK_ID = 1
"""Of m2pem; vehicles count their own links from 0, and a stream has its sender in its name."""

EXAMPLE = "{key: /etc/m2pem/uav1.key}"
_KEYS = ("key", "link_id", "accept_unsigned")


@dataclass(frozen=True, slots=True)
class SigningPolicy:
    """`link_id`: of the first URL; those of the next ones follow. `accept_unsigned`: names of
    messages that are read without a signature, and numbers of components that do not sign.
    `state_folder`: where timestamps are kept; None: nowhere."""

    key: Path
    link_id: int = FIRST_LINK_ID
    accept_unsigned: tuple[str | int, ...] = ()
    state_folder: Path | None = None


def read_signing(
    reader: ConnectionReader, component: int, urls: int, state_folder: Path | None
) -> SigningPolicy | None:
    """Read `connection.signing`; None: there is none. `component`: of the autopilot; `urls`: how
    many the vehicle has.

    Raises:
        PluginError: something is wrong; the text names the resource and the key.
    """
    if "signing" not in reader.values:
        return None
    inner = reader.inner("signing", EXAMPLE)
    inner.refuse_others(_KEYS)
    if "key" not in inner.values:
        raise inner.error("key", f"it is missing: the file of the key, such as {EXAMPLE}")
    key = Path(inner.text("key", "")).expanduser()
    if not key.is_absolute():
        raise inner.error("key", f"{key} is relative: write the whole path, or one from ~/ on")
    link_id = inner.whole("link_id", FIRST_LINK_ID, 0, 256 - urls)
    return SigningPolicy(key, link_id, _unsigned(inner, component), state_folder)


def _unsigned(inner: ConnectionReader, component: int) -> tuple[str | int, ...]:
    value = inner.values.get("accept_unsigned", [])
    if not isinstance(value, list) or not all(_is_name(each) for each in value):
        raise inner.error(
            "accept_unsigned",
            "a list of names of messages, and of numbers of components that do not sign, such as "
            "[RADIO_STATUS, 154]",
        )
    if component in value:
        raise inner.error("accept_unsigned", f"component {component} is the autopilot")
    return tuple(value)


def _is_name(value: Any) -> bool:
    is_component = isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= 255
    return isinstance(value, str) or is_component


def signing_of(
    resource: str, settings: Mapping[str, Any], state_folder: Path | None
) -> SigningPolicy | None:
    """Return how frames of the vehicle of a payload are signed, by the settings of its connection.

    Raises:
        PluginError: something is wrong; the text names the resource and the key.
    """
    urls = settings.get("url")
    reader = ConnectionReader(resource, settings)  # type: ignore[arg-type]
    component = reader.whole("component_id", 1, 1, 255)
    return read_signing(reader, component, len(urls) if isinstance(urls, list) else 1, state_folder)
