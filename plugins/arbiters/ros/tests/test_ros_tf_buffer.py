"""The buffer of transforms, against products of matrices, and what it says of wrong ones."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_ros.frames import Quaternion, quaternion_of_yaw
from m2pem_plugin_ros.sensors.tf_buffer import (
    HELD_NS,
    KEPT_NS,
    Transform,
    TransformBuffer,
    TransformError,
)

SECOND = 1_000_000_000
MAP, ODOM, BASE = "map", "rover1/odom", "rover1/base_link"

numbers = st.floats(-1000.0, 1000.0)
parts = st.floats(-1.0, 1.0)


@st.composite
def transforms(draw: Callable[..., float]) -> Transform:
    turn = [draw(parts) for _ in range(4)]
    length = math.sqrt(sum(part * part for part in turn))
    if length < 0.1:
        turn, length = [0.0, 0.0, 0.0, 1.0], 1.0
    unit = Quaternion(*(part / length for part in turn))
    return Transform((draw(numbers), draw(numbers), draw(numbers)), unit)


def matrix(transform: Transform) -> np.ndarray:
    x, y, z, w = transform.turn
    homogeneous = np.eye(4)
    homogeneous[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    homogeneous[:3, 3] = transform.place
    return homogeneous


class Seconds:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def buffer(clock: Callable[[], float] = lambda: 100.0) -> TransformBuffer:
    return TransformBuffer(clock)


def moved(east: float, north: float = 0.0, yaw: float = 0.0) -> Transform:
    return Transform((east, north, 0.0), quaternion_of_yaw(yaw))


def put(made: TransformBuffer, parent: str, child: str, east: float, at_s: float) -> None:
    assert not made.add(parent, child, moved(east), round(at_s * SECOND), is_static=False)


def place(made: TransformBuffer, source: str, at_s: float | None = None) -> tuple[float, ...]:
    stamp = None if at_s is None else round(at_s * SECOND)
    return made.find(MAP, source, stamp).transform.place


@given(a=transforms(), b=transforms(), c=transforms())
def test_a_chain_is_the_product_of_its_matrices(a: Transform, b: Transform, c: Transform) -> None:
    made = buffer()
    for parent, child, each in (("earth", MAP, a), ("earth", ODOM, b), (ODOM, BASE, c)):
        assert not made.add(parent, child, each, 0, is_static=True)
    found = matrix(made.find(MAP, BASE).transform)
    expected = np.linalg.inv(matrix(a)) @ matrix(b) @ matrix(c)
    assert found == pytest.approx(expected, abs=1e-6)
    back = matrix(made.find(BASE, MAP).transform)
    assert back @ found == pytest.approx(np.eye(4), abs=1e-6)


def test_between_two_stamps_places_are_on_the_line_and_turns_on_the_shorter_arc() -> None:
    made = buffer()
    made.add(MAP, BASE, moved(0.0, 0.0, math.radians(170)), 10 * SECOND, is_static=False)
    made.add(MAP, BASE, moved(4.0, 2.0, math.radians(-170)), 12 * SECOND, is_static=False)
    middle = made.find(MAP, BASE, 11 * SECOND).transform
    assert middle.place == pytest.approx((2.0, 1.0, 0.0))
    assert abs(middle.turn.z) == pytest.approx(1.0)  # 180 degrees, and not 0
    quarter = made.find(MAP, BASE, round(10.5 * SECOND)).transform
    yaw = 2.0 * math.atan2(quarter.turn.z, quarter.turn.w)
    assert math.degrees(yaw) % 360.0 == pytest.approx(175.0)


def test_a_transform_is_held_for_a_while_and_never_extrapolated() -> None:
    made = buffer()
    put(made, MAP, ODOM, 5.0, 10.0)
    put(made, MAP, ODOM, 6.0, 11.0)
    held_s = HELD_NS / SECOND
    assert place(made, ODOM, 11.0 + held_s)[0] == 6.0
    assert place(made, ODOM, 10.0 - held_s)[0] == 5.0
    with pytest.raises(TransformError, match=r"last transform from 'map' to .* is 2.1 s"):
        place(made, ODOM, 11.0 + held_s + 0.1)
    with pytest.raises(TransformError, match=r"first transform .* is 2.1 s newer"):
        place(made, ODOM, 10.0 - held_s - 0.1)


def test_the_newest_pose_is_as_new_as_what_moves_the_vehicle() -> None:
    clock = Seconds()
    made = buffer(clock)
    put(made, MAP, ODOM, 100.0, 10.0)
    clock.now_s = 101.0
    put(made, ODOM, BASE, 1.0, 11.0)
    made.add(BASE, "rover1/lidar", moved(0.5), 0, is_static=True)
    clock.now_s = 101.25
    found = made.find(MAP, "rover1/lidar")
    assert found.transform.place[0] == 101.5
    assert (found.stamp_ns, found.age_s) == (11 * SECOND, 0.25)


def test_old_transforms_are_dropped_and_late_ones_find_their_place() -> None:
    made = buffer()
    put(made, MAP, BASE, 1.0, 100.0)
    put(made, MAP, BASE, 3.0, 102.0)
    put(made, MAP, BASE, 9.0, 101.0)
    assert place(made, BASE, 101.0)[0] == 9.0
    put(made, MAP, BASE, 4.0, 102.0)
    assert place(made, BASE)[0] == 3.0, "a stamp that is repeated is no news"
    put(made, MAP, BASE, 5.0, 102.0 + KEPT_NS / SECOND)
    with pytest.raises(TransformError, match="newer than that"):
        place(made, BASE, 99.0)
    put(made, MAP, BASE, 7.0, 1.0)
    assert place(made, BASE)[0] == 7.0, "the clock of its publisher was set back"


def test_two_parents_are_named_as_long_as_both_are_published() -> None:
    clock = Seconds()
    made = buffer(clock)
    put(made, MAP, BASE, 1.0, 10.0)
    put(made, ODOM, BASE, 2.0, 10.0)
    with pytest.raises(TransformError, match="has two parents, 'map' and 'rover1/odom'"):
        made.find(ODOM, BASE)
    clock.now_s += 3.0
    put(made, ODOM, BASE, 2.0, 13.0)
    assert made.find(ODOM, BASE).transform.place[0] == 2.0


def test_a_static_parent_stays_one() -> None:
    clock = Seconds()
    made = buffer(clock)
    made.add(ODOM, BASE, moved(2.0), 0, is_static=True)
    clock.now_s += 60.0
    put(made, MAP, BASE, 1.0, 10.0)
    with pytest.raises(TransformError, match="has two parents"):
        made.find(MAP, BASE)


def test_a_loop_is_named() -> None:
    made = buffer()
    for parent, child in (("a", "b"), ("b", "c"), ("c", "a")):
        put(made, parent, child, 1.0, 10.0)
    put(made, "a", BASE, 1.0, 10.0)
    with pytest.raises(TransformError, match=r"'a' -> 'b' -> 'c' -> 'a' on /tf are a loop"):
        made.find(MAP, BASE)


def test_a_tree_that_is_too_deep_is_not_looked_up() -> None:
    made = buffer()
    put(made, MAP, "f0", 1.0, 10.0)
    for number in range(99):
        put(made, f"f{number}", f"f{number + 1}", 1.0, 10.0)
    assert place(made, "f98")[0] == 99.0
    put(made, "f99", BASE, 1.0, 10.0)
    with pytest.raises(TransformError, match="more than 100 frames above 'rover1/base_link'"):
        made.find(MAP, BASE)


@pytest.mark.parametrize(
    ("links", "says"),
    [
        ((), "was received on /tf: nothing was"),
        (((ODOM, BASE),), "was received on /tf: there is no 'map'"),
        ((("rover1/map", BASE),), "there is no 'map'; 'rover1/map' is there"),
        (((MAP, "other/odom"),), "there is no 'rover1/base_link'"),
        (
            ((MAP, "x"), (ODOM, BASE)),
            "'map' is under 'map', 'rover1/base_link' under '",
        ),
    ],
)
def test_what_is_missing_is_named(links: tuple[tuple[str, str], ...], says: str) -> None:
    made = buffer()
    for parent, child in links:
        put(made, parent, child, 1.0, 10.0)
    with pytest.raises(TransformError) as raised:
        made.find(MAP, BASE)
    assert str(raised.value).startswith("no transform from 'map' to 'rover1/base_link'")
    assert says in str(raised.value)


@pytest.mark.parametrize(
    ("parent", "child", "transform", "stamp", "says"),
    [
        (MAP, MAP, moved(0.0), 1, "its own parent"),
        ("", BASE, moved(0.0), 1, "names no frame"),
        (MAP, "x" * 201, moved(0.0), 1, "names no frame"),
        (MAP, BASE, moved(math.nan), 1, "not finite"),
        (MAP, BASE, moved(math.inf), 1, "not finite"),
        (MAP, BASE, moved(0.0), 0, "has no stamp"),
    ],
)
def test_what_cannot_be_is_refused(
    parent: str, child: str, transform: Transform, stamp: int, says: str
) -> None:
    made = buffer()
    assert says in made.add(parent, child, transform, stamp, is_static=False)
    assert not made.parents
    assert made.version == 0


def test_names_are_the_same_with_and_without_a_slash() -> None:
    made = buffer()
    put(made, "/map", "/rover1/base_link", 3.0, 10.0)
    assert place(made, "rover1/base_link")[0] == 3.0
