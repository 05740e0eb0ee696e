"""A camera without a network: a head that turns at a bounded rate, in the time of a clock.

A `Gimbal` outlives the arbiter, as a camera outlives a restart. What it is told is kept in `calls`.
"""

import asyncio
import math
from functools import lru_cache

from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.gimbal import CapturedImage, PanTiltZoom, Reach

from m2pem.api import Connection, GeoPosition, ResourceId, VehicleState

ORIGIN = (38.1075, -77.3192, 60.0)
SAYS_EVERY_S = 0.05
DOWN_TO_UP = (-math.pi / 2, math.pi / 2)


def rad(degrees):
    return math.radians(degrees)


class Gimbal:
    """Turns pan and tilt, each no faster than it may, towards what it was told last."""

    def __init__(self, clock=None, **reach):
        self.reach = Reach(**{"rate_rad_s": rad(60), "tilt_rad": DOWN_TO_UP, **reach})
        self.clock = clock
        self.pan = self.tilt = 0.0
        self.zoom = 1.0
        self.told = None
        self.zoom_told = None
        self.rate = None
        self.begun = 0
        self.calls = []
        self.audible = True
        self.stuck = False
        self.refuses = {}
        self.picture_s = 0.2
        self.recording = False
        self._moved_us = None

    def move(self):
        now_us = self.clock.now_us()
        passed_s = 0.0 if self._moved_us is None else (now_us - self._moved_us) / 1e6
        self._moved_us = now_us
        if self.stuck:
            return
        rate = min(self.rate or math.inf, self.reach.rate_rad_s)
        if self.told is not None:
            turn = self.told[0] - self.pan
            if self.reach.endless:
                turn = math.remainder(turn, math.tau)
            self.pan += max(-rate * passed_s, min(rate * passed_s, turn))
            if self.reach.endless:
                low = self.reach.pan_rad[0]
                self.pan = low + (self.pan - low) % math.tau
            rise = self.told[1] - self.tilt
            self.tilt += max(-rate * passed_s, min(rate * passed_s, rise))
        if self.zoom_told is not None:
            change = self.zoom_told - self.zoom
            self.zoom += max(-5 * passed_s, min(5 * passed_s, change))

    @property
    def turning(self):
        return self.told is not None and (self.pan, self.tilt) != self.told


class HeadDriver:
    def __init__(self, setup, gimbal):
        self.setup, self.gimbal = setup, gimbal
        self.gimbal.clock = setup.context.clock
        self._task = None

    async def open(self):
        self._task = asyncio.get_running_loop().create_task(self._say())

    async def close(self):
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    @property
    def ptz(self):
        self.gimbal.move()
        return PanTiltZoom(self.gimbal.pan, self.gimbal.tilt, self.gimbal.zoom)

    @property
    def reach(self):
        return self.gimbal.reach

    def refusal(self, behavior):
        return self.gimbal.refuses.get(behavior, "")

    def point(self, pan_rad, tilt_rad, rate_rad_s=None):
        gimbal = self.gimbal
        gimbal.move()
        low, high = gimbal.reach.pan_rad
        assert low - 1e-9 <= pan_rad <= high + 1e-9, math.degrees(pan_rad)
        assert gimbal.reach.tilt_rad[0] - 1e-9 <= tilt_rad <= gimbal.reach.tilt_rad[1] + 1e-9
        assert rate_rad_s is None or rate_rad_s > 0
        was_told, gimbal.told, gimbal.rate = gimbal.told, (pan_rad, tilt_rad), rate_rad_s
        gimbal.begun += gimbal.turning and was_told is None

    def zoom(self, level):
        self.gimbal.move()
        self.gimbal.calls.append(("zoom", level))
        self.gimbal.zoom_told = level

    def halt(self):
        self.gimbal.move()
        self.gimbal.calls.append("halt")
        self.gimbal.told = self.gimbal.zoom_told = None

    async def take_picture(self):
        gimbal = self.gimbal
        gimbal.calls.append("take_picture")
        await self.setup.context.clock.sleep(gimbal.picture_s)
        if "picture" in gimbal.refuses:
            raise CameraError(gimbal.refuses["picture"])
        number = gimbal.calls.count("take_picture")
        return CapturedImage(self.setup.context.clock.now_us(), b"picture %d" % number)

    async def start_recording(self):
        if "recording" in self.gimbal.refuses:
            raise CameraError(self.gimbal.refuses["recording"])
        self.gimbal.calls.append("start_recording")
        self.gimbal.recording = True

    async def stop_recording(self):
        self.gimbal.calls.append("stop_recording")
        if not self.gimbal.recording:
            raise CameraError("it does not record")
        self.gimbal.recording = False
        return "/media/video.mp4"

    async def _say(self):
        while True:
            if self.gimbal.audible:
                self.setup.on_contact()
            await self.setup.context.clock.sleep(SAYS_EVERY_S)


def connection(name, **settings):
    said = {"driver": "onvif", "reach": {"tilt": ["-90 deg", "90 deg"]}, **settings}
    return Connection(ResourceId(name), "ground", said)


def vehicle(
    name, time_us, east=0.0, north=0.0, up=0.0, yaw=math.pi / 2, velocity=(0, 0, 0), **more
):
    """A vehicle that stands so far from the origin; looking north if nothing else is said."""
    return VehicleState(
        ResourceId(name),
        time_us,
        GeoPosition(*at(east, north, up)),
        velocity_enu_m_s=tuple(map(float, velocity)),
        yaw_rad=yaw,
        **more,
    )


@lru_cache(maxsize=64)  # most vehicles stand
def at(east, north, up=0.0):
    """Latitude, longitude and altitude of a place so far from the origin."""
    import pymap3d

    return tuple(float(part) for part in pymap3d.enu2geodetic(east, north, up, *ORIGIN))
