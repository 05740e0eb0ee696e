"""Tracks by pages."""

from dataclasses import dataclass

from m2pem.api import RunId
from m2pem_plugin_web.tracks.stores import Place
from m2pem_plugin_web.tracks.thinning import Sample
from m2pem_plugin_web.tracks.track import head_of, samples_of


@dataclass(frozen=True, slots=True)
class Page:
    """Samples in order; `after`: what the next page comes after, None: there is none now."""

    samples: tuple[Sample, ...]
    after: float | None


def page_of(place: Place, run: RunId, started_us: int, after_s: float | None, limit: int) -> Page:
    """About `limit` samples later than `after_s`; all of one moment are in the same page.

    Raises:
        OSError: it cannot be read.
    """
    text = place.read(run)
    head = head_of(text)
    if head is None or (head.run, head.started_us) != (run, started_us):
        return Page((), None)
    found: list[Sample] = []
    for sample in samples_of(text):
        if after_s is not None and sample.t <= after_s:
            continue
        if len(found) >= limit and sample.t > found[-1].t:
            return Page(tuple(found), found[-1].t)
        found.append(sample)
    return Page(tuple(found), None)
