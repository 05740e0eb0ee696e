"""The transforms between frames, as /tf and /tf_static tell them (REP-105).

tf2 has such a buffer, in C++, and no wheel. This one tells by name what is wrong, which tf2 does
not: frames with two parents, loops, trees that do not meet, and transforms that are too old.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, Self

from m2pem_plugin_ros.frames import AnyQuaternion, Quaternion, rotated

KEPT_NS = 10_000_000_000
"""The transforms of a frame are kept for this long, by their stamps, as in tf2."""

HELD_NS = 2_000_000_000
"""The last transform counts for so long after its stamp, and the first one for so long before.
None is extrapolated."""

BOTH_WITHIN_S = 2.0
"""A frame has two parents if transforms from both were received within this time, or one of them is
static."""

MOST_FRAMES = 10_000
DEEPEST = 100
"""Frames between a frame and the root of its tree. A deeper tree is none of a vehicle, and looking
it up would take long."""

MOST_KEPT = 2_000
"""Of more transforms of one frame, the oldest are dropped."""

LONGEST_NAME = 200
LARGEST_M = 1e8
"""Larger than Earth: `map` in `earth` is 6 400 km away."""


UNTURNED = Quaternion(0.0, 0.0, 0.0, 1.0)


class TransformError(Exception):
    """There is no transform between two frames. The text says why."""


@dataclass(frozen=True, slots=True)
class Transform:
    """The pose of a frame in another one: where its origin is, and how it is turned."""

    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: Quaternion = UNTURNED

    def apply(self, place: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return a place of the frame in the other one."""
        east, north, up = rotated(place, self.turn)
        return east + self.place[0], north + self.place[1], up + self.place[2]

    def of(self, inner: Self) -> "Transform":
        """Return the pose of what has the pose `inner` in the frame."""
        return Transform(self.apply(inner.place), _product(self.turn, inner.turn))

    def inverse(self) -> "Transform":
        """Return the pose of the other frame in this one."""
        x, y, z, w = self.turn
        back = Quaternion(-x, -y, -z, w)
        east, north, up = rotated(self.place, back)
        return Transform((-east, -north, -up), back)


class Found(NamedTuple):
    """A transform with its stamp (0: all of it is static), and the seconds since it was
    received."""

    transform: Transform
    stamp_ns: int
    age_s: float


@dataclass(slots=True)
class _Link:
    """The transforms of one frame in its parent, by their stamps. A static one has no stamps."""

    parent: str
    is_static: bool
    stamps: list[int] = field(default_factory=list)
    transforms: list[Transform] = field(default_factory=list)
    received_s: float = 0.0

    def add(self, stamp_ns: int, transform: Transform) -> None:
        if self.is_static:
            self.transforms = [transform]
            return
        if self.stamps and stamp_ns < self.stamps[-1] - KEPT_NS:
            self.stamps.clear()  # the clock of the publisher was set back, as at its restart
            self.transforms.clear()
        at = bisect_left(self.stamps, stamp_ns)
        if at < len(self.stamps) and self.stamps[at] == stamp_ns:
            return
        self.stamps.insert(at, stamp_ns)
        self.transforms.insert(at, transform)
        oldest_ns = self.stamps[-1] - KEPT_NS
        drop = max(bisect_left(self.stamps, oldest_ns), len(self.stamps) - MOST_KEPT)
        if drop > 0:
            del self.stamps[:drop], self.transforms[:drop]

    def at(self, stamp_ns: int, frame: str) -> Transform:
        """Return the transform at a time, between two that were received, or the nearest one."""
        if self.is_static:
            return self.transforms[0]
        after = bisect_left(self.stamps, stamp_ns)
        if 0 < after < len(self.stamps):
            before_ns, after_ns = self.stamps[after - 1], self.stamps[after]
            share = (stamp_ns - before_ns) / (after_ns - before_ns)
            return _between(self.transforms[after - 1], self.transforms[after], share)
        nearest = 0 if after == 0 else -1
        apart_ns = stamp_ns - self.stamps[nearest]
        if abs(apart_ns) <= HELD_NS:
            return self.transforms[nearest]
        raise TransformError(
            f"the {'last' if nearest else 'first'} transform from '{self.parent}' to '{frame}' is"
            f" {abs(apart_ns) / 1e9:.1f} s {'older' if nearest else 'newer'} than that: it is not"
            " published any more, or two clocks differ"
        )


class TransformBuffer:
    """The newest transforms of all frames. `now_s` is the clock of receptions.

    Frames are named with or without a leading "/". `topic` is the name of the topic, for texts.
    """

    def __init__(self, now_s: Callable[[], float], topic: str = "/tf") -> None:
        self._now_s = now_s
        self._topic = topic
        self._links: dict[str, _Link] = {}
        self._others: dict[str, _Link] = {}
        self.version = 0
        """It changes with each transform."""

    @property
    def parents(self) -> Mapping[str, str]:
        """The parent of each frame."""
        return {frame: link.parent for frame, link in self._links.items()}

    def add(
        self, parent: str, child: str, transform: Transform, stamp_ns: int, *, is_static: bool
    ) -> str:
        """Keep the pose of `child` in `parent`. Return why it is refused; "" if it is not."""
        parent, child = _name(parent), _name(child)
        if wrong := _wrong(parent, child, transform):
            return wrong
        if not is_static and stamp_ns <= 0:
            return f"the transform from '{parent}' to '{child}' has no stamp"
        now_s = self._now_s()
        link = self._links.get(child)
        if link is None and len(self._links) >= MOST_FRAMES:
            return f"there are more than {MOST_FRAMES} frames"
        if link is not None and link.parent != parent:
            self._others[child] = link
            link = None
        if link is None or link.is_static != is_static:
            link = self._links[child] = _Link(parent, is_static)
        link.add(stamp_ns, transform)
        link.received_s = now_s
        self.version += 1
        return ""

    def find(self, target: str, source: str, stamp_ns: int | None = None) -> Found:
        """Return the pose of the frame `source` in `target`, at a time, or the newest one.

        The newest one is as new as the last moving part of the chain to `source`.

        Raises:
            TransformError: there is none; the text says why.
        """
        target, source = _name(target), _name(source)
        to_source, to_target = self._chain(source), self._chain(target)
        if to_source[-1] != to_target[-1]:
            raise TransformError(self._apart(target, source, to_target[-1], to_source[-1]))
        while len(to_source) > 1 and len(to_target) > 1 and to_source[-2] == to_target[-2]:
            to_source.pop()  # what is above the frame where the two meet is in both
            to_target.pop()
        moving = [
            link
            for frame in (*to_source[:-1], *to_target[:-1])
            if not (link := self._links[frame]).is_static
        ]
        if stamp_ns is None:
            stamp_ns = moving[0].stamps[-1] if moving else 0
        root_to_source = self._pose(to_source, stamp_ns)
        root_to_target = self._pose(to_target, stamp_ns)
        received = [self._links[frame].received_s for frame in (*to_source[:-1], *to_target[:-1])]
        newest_s = moving[0].received_s if moving else min(received, default=self._now_s())
        return Found(
            root_to_target.inverse().of(root_to_source),
            stamp_ns if moving else 0,
            self._now_s() - newest_s,
        )

    def _chain(self, frame: str) -> list[str]:
        """Return the frame, its parent, and so on, to the root."""
        chain = [frame]
        while (link := self._links.get(chain[-1])) is not None:
            self._check_parents(chain[-1], link)
            if link.parent in chain:
                loop = [*chain[chain.index(link.parent) :], link.parent]
                named = " -> ".join(f"'{each}'" for each in reversed(loop))
                raise TransformError(f"the frames {named} on {self._topic} are a loop")
            if len(chain) > DEEPEST:
                raise TransformError(
                    f"there are more than {DEEPEST} frames above '{frame}' on {self._topic}"
                )
            chain.append(link.parent)
        return chain

    def _check_parents(self, frame: str, link: _Link) -> None:
        other = self._others.get(frame)
        if other is None or other.parent == link.parent:
            return
        if not other.is_static and self._now_s() - other.received_s > BOTH_WITHIN_S:
            del self._others[frame]
            return
        first, second = sorted((other.parent, link.parent))
        raise TransformError(
            f"the frame '{frame}' on {self._topic} has two parents, '{first}' and '{second}': two"
            " nodes publish it"
        )

    def _pose(self, chain: list[str], stamp_ns: int) -> Transform:
        """Return the pose of the first frame of a chain in the last one."""
        pose = Transform()
        for frame in chain[:-1]:
            pose = self._links[frame].at(stamp_ns, frame).of(pose)
        return pose

    def _apart(self, target: str, source: str, target_root: str, source_root: str) -> str:
        text = f"no transform from '{target}' to '{source}' was received on {self._topic}"
        if not self._links:
            return f"{text}: nothing was"
        known = {*self._links, *(link.parent for link in self._links.values())}
        for frame in (target, source):
            if frame not in known:
                like = min((each for each in known if each.endswith(f"/{frame}")), default="")
                hint = f"; '{like}' is there" if like else ""
                return f"{text}: there is no '{frame}'{hint}"
        return f"{text}: '{target}' is under '{target_root}', '{source}' under '{source_root}'"


def transform_of(place: object, turn: AnyQuaternion) -> Transform:
    """Return a transform of the numbers of geometry_msgs, with a rotation of length 1.

    Raises:
        ValueError: the quaternion is zero or not finite.
    """
    x, y, z = place.x, place.y, place.z  # type: ignore[attr-defined]
    length = math.sqrt(turn.x**2 + turn.y**2 + turn.z**2 + turn.w**2)
    if not (1e-3 < length < math.inf):
        raise ValueError(f"({turn.x:g}, {turn.y:g}, {turn.z:g}, {turn.w:g}) is not a rotation")
    unit = Quaternion(turn.x / length, turn.y / length, turn.z / length, turn.w / length)
    return Transform((x, y, z), unit)


def _name(frame: str) -> str:
    return frame.removeprefix("/")


def _wrong(parent: str, child: str, transform: Transform) -> str:
    if not parent or not child or max(len(parent), len(child)) > LONGEST_NAME:
        return f"a transform from '{parent[:50]}' to '{child[:50]}' names no frame"
    if parent == child:
        return f"the frame '{child}' is its own parent"
    if not all(-LARGEST_M <= number <= LARGEST_M for number in transform.place):
        return f"the transform from '{parent}' to '{child}' is not finite"
    return ""


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    return Quaternion(
        a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
        a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
    )


def _between(a: Transform, b: Transform, share: float) -> Transform:
    """Return what lies between: places on a line, rotations along the shorter arc (slerp)."""
    place = tuple(p + share * (q - p) for p, q in zip(a.place, b.place, strict=True))
    dot = sum(p * q for p, q in zip(a.turn, b.turn, strict=True))
    sign = -1.0 if dot < 0.0 else 1.0
    angle = math.acos(min(1.0, abs(dot)))
    if angle < 1e-6:
        before, after = 1.0 - share, sign * share
    else:
        before = math.sin((1.0 - share) * angle) / math.sin(angle)
        after = sign * math.sin(share * angle) / math.sin(angle)
    turn = [before * p + after * q for p, q in zip(a.turn, b.turn, strict=True)]
    length = math.sqrt(sum(part * part for part in turn))
    return Transform((place[0], place[1], place[2]), Quaternion(*(part / length for part in turn)))
