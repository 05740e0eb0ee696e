"""Directions from the deck and from the horizon."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_ptz.drivers.mavlink.context import deck_to_horizon, horizon_to_deck

PAN = st.floats(-math.pi, math.pi)
TILT = st.floats(-1.4, 1.4)
LEAN = st.floats(-0.7, 0.7)


def about(axis, angle_rad):
    """A rotation by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle_rad) * cross + (1 - math.cos(angle_rad)) * cross @ cross


def seen(direction):
    pan, tilt = direction
    return np.array(
        [math.cos(tilt) * math.cos(pan), -math.cos(tilt) * math.sin(pan), math.sin(tilt)]
    )


@given(PAN, TILT, LEAN, LEAN)
def test_angles_of_the_mount_and_of_the_mission_are_the_same_direction(pan, tilt, roll, pitch):
    turned = about((0, 1, 0), pitch) @ about((1, 0, 0), roll) @ seen((pan, tilt))
    assert seen(deck_to_horizon((pan, tilt), roll, pitch)) == pytest.approx(turned, abs=1e-9)


@given(PAN, TILT, LEAN, LEAN)
def test_back_and_forth_changes_nothing(pan, tilt, roll, pitch):
    back = horizon_to_deck(deck_to_horizon((pan, tilt), roll, pitch), roll, pitch)
    assert seen(back) == pytest.approx(seen((pan, tilt)), abs=1e-9)


def test_signs_are_those_of_a_vehicle_state():
    ahead, right = (0.0, 0.0), (math.pi / 2, 0.0)
    assert deck_to_horizon(ahead, 0.0, 0.2)[1] == pytest.approx(-0.2)  # the nose is down
    assert deck_to_horizon(right, 0.2, 0.0)[1] == pytest.approx(-0.2)  # the right side is down
