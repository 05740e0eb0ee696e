"""A camera that answers late looks where it is wanted to, in simulated time."""

import heapq
import itertools
import math
from random import Random

import pytest
from m2pem_plugin_ptz.drivers.onvif.steering import (
    TAKES_EFFECT,
    AbsoluteMove,
    ContinuousMove,
    Steering,
)
from m2pem_plugin_ptz.gimbal import Reach
from m2pem_plugin_ptz.simulator.onvif.camera import Axis, Gimbal

rad, deg = math.radians, math.degrees
QUICK, SLOW, MIXED = (0.05, 0.05), (0.2, 0.2), (0.05, 0.2)
EVERY_S = 0.125
RATE = rad(60)


class Play:
    """A camera, what steers it, and calls that take time on their way there and back."""

    def __init__(self, target, calls_s, *, gain=1.0, drives=True, endless=False):
        reach = Reach(rate_rad_s=RATE, endless=endless)
        self.steering = Steering(reach, drives=drives)
        stops = None if endless else (-math.pi, math.pi)
        self.gimbal = Gimbal(
            Axis(stops, RATE, rad(240)), Axis((-1.5, 1.5), RATE, rad(240)), Axis(None, 1, 1)
        )
        self.target, self.gain = target, gain
        self.sent, self.errors = [], []
        self._between = Random(1).uniform
        self._calls_s = calls_s
        self._queue, self._count = [], itertools.count()
        for first in (self._wish, self._ask, self._move, self._measure):
            self._at(0.0, first)

    def _at(self, time_s, what):
        heapq.heappush(self._queue, (time_s, next(self._count), what))

    def _way_s(self):
        return self._between(*self._calls_s) / 2

    def run(self, seconds, settle_s=6.0):
        """The worst error after `settle_s`, in degrees."""
        while self._queue[0][0] < seconds:
            time_s, _, what = heapq.heappop(self._queue)
            what(time_s)
        return max(error for time_s, error in self.errors if time_s > settle_s)

    def _wish(self, now_s):
        self.steering.target.add(*self.target(now_s), None, now_s)
        self._at(now_s + 1 / 15, self._wish)

    def _ask(self, began_s):
        def ptz(now_s):
            self.gimbal.advance(now_s)
            pan = self.gimbal.pan.at
            if self.gimbal.pan.stops is None:
                pan = math.remainder(pan, math.tau)
            found = pan, self.gimbal.tilt.at
            self._at(now_s + self._way_s(), lambda then_s: heard(then_s, found))

        def heard(now_s, found):
            self.steering.observe(*found, (began_s + now_s) / 2)
            self._at(max(now_s, began_s + EVERY_S), self._ask)

        self._at(began_s + self._way_s(), ptz)

    def _move(self, began_s):
        move = self.steering.next(began_s)
        if move is None:
            self._at(began_s + EVERY_S, self._move)
            return
        self.sent.append(move)

        def obey(now_s):
            self.gimbal.advance(now_s)
            pan, tilt = self.gimbal.pan, self.gimbal.tilt
            if isinstance(move, AbsoluteMove):
                pan.go(move.pan_rad, move.rate_rad_s)
                tilt.go(move.tilt_rad, move.rate_rad_s)
            else:
                pan.run(move.pan_rad_s * self.gain, now_s + 1.0)
                tilt.run(move.tilt_rad_s * self.gain, now_s + 1.0)
            self._at(now_s + self._way_s(), done)

        def done(now_s):
            self.steering.measure_call(now_s - began_s)
            self.steering.sent(move, began_s + TAKES_EFFECT * (now_s - began_s))
            self._at(max(now_s, began_s + EVERY_S), self._move)

        self._at(began_s + self._way_s(), obey)

    def _measure(self, now_s):
        self.gimbal.advance(now_s)
        pan, tilt = self.target(now_s)
        apart = self.steering.target.apart((pan, tilt), (self.gimbal.pan.at, self.gimbal.tilt.at))
        self.errors.append((now_s, deg(max(map(abs, apart)))))
        self._at(now_s + 0.02, self._measure)


def still(_):
    return rad(50), rad(-10)


def drift(t):
    return rad(0.1 * t), rad(-5)


def turn(t):
    return rad(-100 + 5 * t), rad(-5 - 0.2 * t)


def sway(t):
    return rad(20 * math.sin(math.tau * t / 20)), rad(-10 + 3 * math.sin(math.tau * t / 7))


def passing(t):
    return math.atan2(10 * (t - 20), 60), rad(-8)


@pytest.mark.parametrize("calls_s", [QUICK, SLOW, MIXED])
@pytest.mark.parametrize("target", [still, drift, turn, sway, passing])
def test_the_error_stays_below_a_degree_while_calls_take_50_to_200_ms(target, calls_s):
    assert Play(target, calls_s).run(40) < 1.0


@pytest.mark.parametrize("gain", [0.8, 1.25])
@pytest.mark.parametrize("target", [turn, sway])
def test_a_camera_that_turns_more_or_less_quickly_than_it_says_is_followed_too(target, gain):
    assert Play(target, QUICK, gain=gain).run(40) < 1.0


def test_a_camera_without_velocities_follows_by_absolute_moves():
    play = Play(turn, QUICK, drives=False)
    assert play.run(40) < 1.0
    assert not any(isinstance(move, ContinuousMove) for move in play.sent)


def test_a_target_that_stands_is_told_once():
    play = Play(still, QUICK)
    play.run(20)
    assert play.sent == [AbsoluteMove(rad(50), rad(-10), RATE)]


def test_far_targets_get_absolute_moves_and_near_ones_velocities():
    play = Play(turn, QUICK)
    play.run(30)
    kinds = [type(move) for move in play.sent]
    assert kinds[0] is AbsoluteMove
    assert kinds[-1] is ContinuousMove
    assert kinds.index(ContinuousMove) < 12, "it has caught up within seconds"
    assert AbsoluteMove not in kinds[kinds.index(ContinuousMove) :]


def test_an_endless_camera_goes_on_all_round():
    play = Play(lambda t: (math.remainder(rad(8 * t), math.tau), 0.0), QUICK, endless=True)
    assert play.run(60) < 1.0
    assert play.gimbal.pan.at > math.tau, "it went on, and not back"


def test_another_rate_is_told_while_there_is_a_way_to_go_at_it():
    steering = Steering(Reach(rate_rad_s=1.0))
    for seen, rate, told in (
        (0.0, 1.0, AbsoluteMove(1.0, 0.0, 1.0)),
        (0.1, 0.5, AbsoluteMove(1.0, 0.0, 0.5)),
        (0.2, 1.0, AbsoluteMove(1.0, 0.0, 1.0)),
        (0.9, 0.4, None),
        (0.99, 0.02, None),
    ):
        steering.target.add(1.0, 0.0, rate, seen)
        steering.observe(seen, 0.0, seen)
        assert steering.next(seen) == told
        if told is not None:
            steering.sent(told, seen)


def test_a_wish_out_of_reach_is_met_as_far_as_it_goes():
    steering = Steering(Reach(pan_rad=(-1.0, 1.0), tilt_rad=(-0.5, 0.2)))
    steering.target.add(2.0, 1.0, 9.0, 0.0)
    assert steering.next(0.0) == AbsoluteMove(1.0, 0.2, 1.0)


def test_a_jump_of_the_wish_is_another_target_and_no_speed():
    steering = Steering(Reach())
    for step in range(5):
        steering.target.add(0.0, 0.0, None, step / 15)
    steering.target.add(1.5, 0.0, None, 5 / 15)
    assert steering.target.velocity(5 / 15) == (0.0, 0.0)


def test_a_camera_that_does_not_turn_is_told_again_and_then_is_stuck():
    steering = Steering(Reach())
    steering.target.add(1.0, 0.0, None, 0.0)
    now_s, told = 0.0, 0
    while now_s < 8.0:
        steering.observe(0.0, 0.0, now_s)
        move = steering.next(now_s)
        if move is not None:
            told += 1
            steering.sent(move, now_s)
        now_s += EVERY_S
    assert 4 <= told <= 6
    assert steering.stuck
    steering.observe(0.1, 0.0, now_s)
    assert not steering.stuck
