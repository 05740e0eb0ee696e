import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.units import UNITS, Dimension, UnitError, plain_number, quantity


@pytest.mark.parametrize(
    ("text", "dimension", "si"),
    [
        ("30 s", Dimension.DURATION, 30.0),
        ("2 min", Dimension.DURATION, 120.0),
        ("1 h", Dimension.DURATION, 3600.0),
        ("250ms", Dimension.DURATION, 0.25),
        ("80 m", Dimension.DISTANCE, 80.0),
        ("2 km", Dimension.DISTANCE, 2000.0),
        ("300 ft", Dimension.DISTANCE, 91.44),
        ("1.5 m/s", Dimension.SPEED, 1.5),
        ("5 km/h", Dimension.SPEED, 5 / 3.6),
        ("10 kn", Dimension.SPEED, 5.144444444444445),
        ("0.5 m/s2", Dimension.ACCELERATION, 0.5),
        ("0.5m/s²", Dimension.ACCELERATION, 0.5),
        (0.5, Dimension.ACCELERATION, 0.5),
        ("45 deg", Dimension.ANGLE, math.pi / 4),
        ("1.57 rad", Dimension.ANGLE, 1.57),
        ("10 deg/s", Dimension.ANGULAR_SPEED, math.radians(10)),
        ("10 Hz", Dimension.FREQUENCY, 10.0),
        (" -1e2 m ", Dimension.DISTANCE, -100.0),
        ("80", Dimension.DISTANCE, 80.0),
        (80, Dimension.DISTANCE, 80.0),
        (0.5, Dimension.DURATION, 0.5),
    ],
)
def test_a_quantity_is_read_to_si(text: object, dimension: Dimension, si: float) -> None:
    assert quantity(text, dimension) == pytest.approx(si, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "dimension", "message"),
    [
        ("5 m", Dimension.SPEED, "'5 m' is a distance, not a speed"),
        ("5 m/z", Dimension.SPEED, "unknown unit 'm/z'; did you mean 'm/s'"),
        ("5 M", Dimension.DISTANCE, "unknown unit 'M'; did you mean 'm'"),
        ("5 parsec", Dimension.DISTANCE, "a distance is written with m, cm, km"),
        ("fast", Dimension.SPEED, "is not a number with a unit"),
        ("", Dimension.SPEED, "is not a number with a unit"),
        ("5 5 m", Dimension.DISTANCE, "is not a number with a unit"),
        ("٣ m", Dimension.DISTANCE, "is not a number with a unit"),
        ("5 m/s", Dimension.ACCELERATION, "'5 m/s' is a speed, not an acceleration"),
        ("45", Dimension.ANGLE, "an angle needs one: '45 deg' or '45 rad'"),
        (45, Dimension.ANGLE, "an angle needs one: '45 deg' or '45 rad'"),
        (1.0, Dimension.ANGULAR_SPEED, "'1.0 deg/s' or '1.0 rad/s'"),
        ("1e999 m", Dimension.DISTANCE, "is too large"),
        (math.inf, Dimension.DISTANCE, "is not a number"),
        (math.nan, Dimension.DISTANCE, "is not a number"),
        (True, Dimension.DURATION, "True is not a duration"),
        (None, Dimension.DURATION, "None is not a duration"),
    ],
)
def test_what_is_no_such_quantity_is_refused_with_what_would_be_right(
    text: object, dimension: Dimension, message: str
) -> None:
    with pytest.raises(UnitError) as refused:
        quantity(text, dimension)
    assert message in str(refused.value)


dimensions_and_units = st.sampled_from([(d, unit) for d, units in UNITS.items() for unit in units])
numbers = st.floats(min_value=-1e12, max_value=1e12)


@given(numbers, dimensions_and_units)
def test_every_unit_scales_what_its_number_says(
    number: float, written: tuple[Dimension, str]
) -> None:
    dimension, unit = written
    assert quantity(f"{number!r} {unit}", dimension) == number * UNITS[dimension][unit]


@given(numbers, dimensions_and_units, st.sampled_from(Dimension))
def test_a_unit_of_another_dimension_never_passes(
    number: float, written: tuple[Dimension, str], asked: Dimension
) -> None:
    dimension, unit = written
    if dimension is not asked:
        with pytest.raises(UnitError):
            quantity(f"{number!r}{unit}", asked)


@given(st.text(), st.sampled_from(Dimension))
def test_any_text_is_read_or_refused(text: str, dimension: Dimension) -> None:
    try:
        result = quantity(text, dimension)
    except UnitError:
        return
    assert math.isfinite(result)


@given(numbers)
def test_a_plain_number_is_read_from_its_text(number: float) -> None:
    assert plain_number(repr(number)) == number
    assert plain_number(number) == number


@pytest.mark.parametrize("value", ["5 m", "x", "", "1e999", True, None, math.nan, [5]])
def test_what_is_no_plain_number_is_refused(value: object) -> None:
    with pytest.raises(UnitError):
        plain_number(value)
