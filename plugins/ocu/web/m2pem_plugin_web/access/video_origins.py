"""The origins from which the page may load videos and pictures of the fleet's cameras."""

from collections.abc import Mapping
from urllib.parse import urlsplit

from m2pem.api import Fleet

DIRECTIVES: Mapping[str, tuple[str, ...]] = {
    "hls": ("connect-src", "media-src"),
    "webrtc": ("connect-src",),
    "mjpeg": ("connect-src", "img-src"),
    "image": ("img-src",),
}
"""Of Content-Security-Policy, by the kind of video."""


def origins_of(fleet: Fleet) -> dict[str, str]:
    """Return what the fleet adds to each directive: origins, with a space before each."""
    found: dict[str, dict[str, None]] = {}
    for video in fleet.videos.values():
        parts = urlsplit(video.url)
        for directive in DIRECTIVES[video.kind.value]:
            found.setdefault(directive, {})[f"{parts.scheme}://{parts.netloc}"] = None
    return {
        directive: "".join(f" {each}" for each in origins) for directive, origins in found.items()
    }
