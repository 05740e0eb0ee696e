"""A camera on a vehicle that moves as a test says, worked by the arbiter in virtual time."""

import asyncio
import math

import pymap3d
from m2pem_plugin_ptz.arbiter import PtzArbiter
from ptz_fake_camera import ORIGIN, Gimbal, HeadDriver, connection, vehicle

from m2pem.api import Area, Point, ResourceId
from m2pem.api.clock import run_virtual
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

START_US = 1_767_225_600_000_000
CAMERA = ResourceId("ugv/ptz")


class World:
    """`bench` has the reports of the arbiter; `looks` are kept if `watch` is called. `gimbal` is
    the camera itself; `moves` returns the vehicle's pose at a time in seconds (arguments of
    `ptz_fake_camera.vehicle`)."""

    def __init__(self, clock, gimbal, moves, domain):
        self.clock, self.gimbal, self.moves, self.domain = clock, gimbal, moves, domain
        self.context = context(clock)
        self.bench = None
        self.others = {}
        self.silent = False

    @property
    def seconds(self):
        return (self.clock.now_us() - START_US) / 1e6

    def truth(self, name="ugv"):
        moves = self.moves if name == "ugv" else self.others[name]
        return vehicle(name, self.clock.now_us(), **moves(self.seconds))

    async def publish(self, every_s=0.2):
        while True:
            for name in ("ugv", *self.others):
                moves = self.moves if name == "ugv" else self.others[name]
                if moves is not None and not self.silent:
                    self.context.bus.publish(self.truth(name))
            await self.clock.sleep(every_s)

    async def do(self, behavior, within_s=600.0, id_="r1.b1", **parameters):
        await self.bench.start(id_, behavior, CAMERA, **parameters)
        return await self.bench.ended(id_, within_s)

    async def until(self, true, within_s=60.0, step_s=0.02):
        limit = self.seconds + within_s
        while not true():
            assert self.seconds < limit, f"not within {within_s} s"
            await self.clock.sleep(step_s)

    def off_target(self, place):
        """How far the head looks away from a place (latitude, longitude, altitude): its bearing and
        elevation from the mast of the vehicle, which is level, by pymap3d."""
        state = self.truth()
        here = state.position
        azimuth, elevation, _ = pymap3d.geodetic2aer(
            *place, here.latitude_deg, here.longitude_deg, here.altitude_m + 2.0
        )
        self.gimbal.move()
        heading = math.pi / 2 - state.yaw_rad + self.gimbal.pan
        up, level = math.sin(self.gimbal.tilt), math.cos(self.gimbal.tilt)
        el, az = math.radians(elevation), math.radians(azimuth)
        cosine = up * math.sin(el) + level * math.cos(el) * math.cos(heading - az)
        return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))


def play(main, gimbal=None, moves=lambda _: {}, domain="ground", others=None, **settings):
    """Run `main(world)` with a connected arbiter."""
    gimbal = gimbal or Gimbal()

    async def run(clock):
        world = World(clock, gimbal, moves, domain)
        world.others = dict(others or {})
        publishing = asyncio.create_task(world.publish())
        await clock.sleep(0.3)
        made = connection(CAMERA, **settings)
        made = type(made)(made.resource, domain, made.settings, made.behaviors)
        arbiter = PtzArbiter({CAMERA: made}, world.context, lambda setup: HeadDriver(setup, gimbal))
        try:
            async with ArbiterHarness(arbiter, clock) as world.bench:
                return await main(world)
        finally:
            publishing.cancel()
            await asyncio.gather(publishing, return_exceptions=True)

    return run_virtual(run, START_US)


def point(east, north, up=None):
    lat, lon, _ = pymap3d.enu2geodetic(east, north, 0.0, *ORIGIN)
    return Point((float(lat), float(lon), up))


def area(*corners, holes=()):
    def ring(places):
        return tuple(point(*place).position for place in (*places, places[0]))

    return Area((ring(corners), *(ring(hole) for hole in holes)))
