"""The capabilities of a media profile of a camera."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from m2pem_plugin_ptz.drivers.onvif.session import RefusedError, Session, camera
from m2pem_plugin_ptz.drivers.onvif.spaces import (
    Interval,
    PtzSpaces,
    SpaceDescription,
    Spaces,
    read_spaces,
)
from m2pem_plugin_ptz.gimbal import Reach


@dataclass(frozen=True, slots=True)
class Capabilities:
    """`spaces` None: the camera does not turn. `snapshot`: URL of pictures; if it is "",
    `no_snapshot` says why. `records`: it has a recording service."""

    profile: str
    spaces: Spaces | None
    snapshot: str
    no_snapshot: str
    records: bool


@dataclass(frozen=True, slots=True)
class _Profile:
    """`configuration`: the token of its PTZ configuration, "" if it has none."""

    token: str
    name: str
    configuration: str
    service: str


async def read_capabilities(session: Session, reach: Reach) -> Capabilities:
    """Request the capabilities. `reach` is that of the fleet.

    Raises:
        CameraError: the camera did not answer, or its answer contradicts the fleet file.
    """
    profile = await _profile(session)
    spaces = await _spaces(session, profile, reach) if profile.configuration else None
    snapshot, why = "", ""
    try:
        answer = await session.call(profile.service, "GetSnapshotUri", ProfileToken=profile.token)
        snapshot = str(getattr(answer, "Uri", answer) or "")
        why = "" if snapshot else f"{camera(session.settings)} reports no URL of its pictures"
    except RefusedError as error:
        why = error.reason
    records = session.has("recording")
    return Capabilities(profile.token, spaces, snapshot and session.near(snapshot), why, records)


async def _profile(session: Session) -> _Profile:
    known = await _profiles(session)
    wanted = session.settings.profile
    if wanted:
        for each in known:
            if wanted in (each.token, each.name):
                return each
        names = ", ".join(f"{each.name} ({each.token})" for each in known) or "none"
        raise RefusedError(
            f"connection.profile: {camera(session.settings)} has no profile {wanted!r}; it has: "
            f"{names}",
            "REJECTED",
        )
    if not known:
        raise RefusedError(
            f"{camera(session.settings)} has no media profile: create one in the camera"
        )
    return next((each for each in known if each.configuration), known[0])


async def _profiles(session: Session) -> list[_Profile]:
    if session.has("media"):
        found = await session.call("media", "GetProfiles")
        return [
            _Profile(each.token, str(each.Name), _token(each.PTZConfiguration), "media")
            for each in found or ()
        ]
    found = await session.call("media2", "GetProfiles", Type=["PTZ"])
    return [
        _Profile(each.token, str(each.Name), _turning(each.Configurations), "media2")
        for each in found or ()
    ]


def _token(configuration: Any) -> str:
    return "" if configuration is None else str(configuration.token)


def _turning(configurations: Any) -> str:
    """Return the token of the element PTZ, which zeep leaves as XML."""
    for element in getattr(configurations, "_value_1", None) or ():
        if str(getattr(element, "tag", "")).endswith("}PTZ"):
            return str(element.get("token") or "")
    return ""


async def _spaces(session: Session, profile: _Profile, reach: Reach) -> Spaces:
    said = await session.call(
        "ptz", "GetConfiguration", PTZConfigurationToken=profile.configuration
    )
    node = await session.call("ptz", "GetNode", NodeToken=said.NodeToken)
    listed = node.SupportedPTZSpaces
    limits = getattr(said.PanTiltLimits, "Range", None)
    offer = PtzSpaces(
        positions=_described(listed.AbsolutePanTiltPositionSpace),
        velocities=_described(listed.ContinuousPanTiltVelocitySpace),
        speeds=_described(listed.PanTiltSpeedSpace),
        zooms=_described(listed.AbsoluteZoomPositionSpace),
        limits=next(iter(_described([limits])), None),
        default_position=str(said.DefaultAbsolutePantTiltPositionSpace or ""),
    )
    try:
        return read_spaces(offer, reach, session.settings.inverted)
    except ValueError as error:
        raise RefusedError(f"{camera(session.settings)}: {error}", "REJECTED") from error


def _described(spaces: Iterable[Any] | None) -> list[SpaceDescription]:
    found = []
    for each in spaces or ():
        x = _interval(getattr(each, "XRange", None))
        if x is not None and each.URI:
            found.append(
                SpaceDescription(str(each.URI), x, _interval(getattr(each, "YRange", None)))
            )
    return found


def _interval(said: Any) -> Interval | None:
    """Return a valid range; None for an endless or missing one."""
    if said is None or said.Min is None or said.Max is None:
        return None
    low, high = float(said.Min), float(said.Max)
    return (low, high) if abs(low) < 1e6 and abs(high) < 1e6 and low < high else None
