"""The track of one run: a head, then a line of JSON for each sample."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import msgspec

from m2pem.api import PayloadState, RunId, VehicleState
from m2pem_plugin_web.tracks.detections import Numbering
from m2pem_plugin_web.tracks.stores import TrackStore, TrackText
from m2pem_plugin_web.tracks.thinning import SPACING_S, Sample, Thinner, thinned

_encode = msgspec.json.Encoder().encode


class Head(msgspec.Struct, frozen=True):
    """`started_us` distinguishes the run from one of that name in another journal."""

    run: RunId
    started_us: int
    spacing_s: float = SPACING_S


_head = msgspec.json.Decoder(Head)
_sample = msgspec.json.Decoder(Sample)
_STATES: dict[str, Any] = {
    "vehicles": msgspec.json.Decoder(VehicleState),
    "payloads": msgspec.json.Decoder(PayloadState),
}


def head_of(text: bytes) -> Head | None:
    """Return the head of a text; None if the text is not a track."""
    try:
        return _head.decode(text[: text.index(b"\n")])
    except (ValueError, msgspec.DecodeError):
        return None


def samples_of(text: bytes) -> Iterator[Sample]:
    """Yield all samples of a text, in order; skip lines that are torn or damaged."""
    _, *lines = text.split(b"\n")[:-1] or [b""]
    for line in lines:
        try:
            yield _sample.decode(line)
        except (ValueError, msgspec.DecodeError):
            continue


class Track:
    """A track open for writing; samples must be later than the last one.

    `thinner` knows the kept states, `numbering` the detections.

    `t_s`: the present mission time. Later samples are dropped: the run was resumed from a journal
    that ends before them.

    Raises:
        OSError: it cannot be read or written.
        HeldError: another page writes it.
    """

    def __init__(self, store: TrackStore, head: Head, t_s: float) -> None:
        self.run = head.run
        self._most = store.most_bytes
        self._head = head
        self._kept: TrackText = store.open(head.run)
        try:
            self._begin(t_s)
        except BaseException:
            self._kept.close()
            raise

    def _begin(self, t_s: float) -> None:
        text = self._kept.read()
        found = head_of(text)
        samples: list[Sample] = []
        if found is not None and (found.run, found.started_us) == (
            self._head.run,
            self._head.started_us,
        ):
            self._head = found
            samples = [each for each in samples_of(text) if each.t <= t_s]
        whole = self._text(samples)
        if whole != text:
            self._kept.replace(whole)
        self._size = len(whole)
        self.thinner = Thinner(self._head.spacing_s)
        self.is_new = not samples
        """Whether the track was empty."""
        self.last_s = samples[-1].t if samples else 0.0
        """The mission time of the last sample that was there."""
        self._remember(samples)
        self.numbering = Numbering(
            (entry for sample in samples for entry in sample.detections),
            sum(sample.more_detections for sample in samples),
        )

    def append(self, samples: Sequence[Sample]) -> None:
        """Write samples.

        Raises:
            OSError: nothing was written.
        """
        text = b"".join(_encode(each) + b"\n" for each in samples)
        if self._size + len(text) > self._most:
            self._thin(samples)
            return
        self._kept.append(text)
        self._size += len(text)

    def close(self) -> None:
        """Close the track for writing."""
        self._kept.close()

    def _thin(self, more: Sequence[Sample]) -> None:
        samples = [*samples_of(self._kept.read()), *more]
        span_s = samples[-1].t - samples[0].t
        head, text = self._head, b""
        while not text or (len(text) > self._most // 2 and head.spacing_s <= span_s):
            head = msgspec.structs.replace(head, spacing_s=head.spacing_s * 2)
            samples = thinned(samples, head.spacing_s)
            text = self._text(samples, head)
        self._kept.replace(text)
        self._head, self._size = head, len(text)
        self.thinner.spacing_s = head.spacing_s

    def _text(self, samples: Sequence[Sample], head: Head | None = None) -> bytes:
        lines = [_encode(head or self._head), *map(_encode, samples)]
        return b"".join(line + b"\n" for line in lines)

    def _remember(self, samples: Sequence[Sample]) -> None:
        last: dict[tuple[str, str], tuple[float, msgspec.Raw]] = {}
        for sample in samples:
            for kind, states in sample.kinds():
                last.update({(kind, name): (sample.t, raw) for name, raw in states.items()})
        for (kind, _), (t_s, raw) in last.items():
            # A device may send values that a state cannot have.
            with suppress(ValueError, msgspec.DecodeError):
                self.thinner.keep(t_s, _STATES[kind].decode(raw))


@dataclass(frozen=True, slots=True)
class Page:
    """Samples in order. `after`: the time after which the next page begins; None at the end."""

    samples: tuple[Sample, ...]
    after: float | None


def page_of(
    store: TrackStore, run: RunId, started_us: int, after_s: float | None, limit: int
) -> Page:
    """Return about `limit` samples later than `after_s`; all of one moment are in the same page.

    Raises:
        OSError: it cannot be read.
    """
    text = store.read(run)
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
