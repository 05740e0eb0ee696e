"""Looking over sectors and areas. What was seen is counted by a check of its own: places at random
in the area, each of which must have been in the picture at some time, by pymap3d."""

import math
import random
from itertools import pairwise

import numpy as np
import pymap3d
import pytest
from m2pem_plugin_ptz.camera_model.field_of_view import FieldOfView
from m2pem_plugin_ptz.camera_model.pose import VehiclePose, camera_pose
from m2pem_plugin_ptz.settings import Mounting
from ptz_fake_camera import ORIGIN, Gimbal, rad
from ptz_world import CAMERA, area, play

from m2pem.api import BehaviorState, parse_geojson

VIEW = (rad(60), rad(34))
SQUARE = ((-40, 60), (40, 60), (40, 140), (-40, 140))
CONCAVE = ((-60, 30), (60, 30), (60, 120), (30, 120), (30, 60), (-30, 60), (-30, 120), (-60, 120))
FIELD = ((-150, 20), (150, 20), (150, 320), (-150, 320))
AROUND = ((-60, -60), (60, -60), (60, 60), (-60, 60))


def inside(ring, east, north):
    odd = False
    for (x1, y1), (x2, y2) in zip(ring, (*ring[1:], ring[0]), strict=True):
        if (y1 > north) != (y2 > north) and east < x1 + (north - y1) / (y2 - y1) * (x2 - x1):
            odd = not odd
    return odd


class Witness:
    """Places at random, and which of them were in the picture of a level camera."""

    def __init__(self, ring, holes=(), count=1500):
        dice = random.Random(7)
        xs, ys = [x for x, _ in ring], [y for _, y in ring]
        points = []
        while len(points) < count:
            east, north = dice.uniform(min(xs), max(xs)), dice.uniform(min(ys), max(ys))
            if inside(ring, east, north) and not any(inside(hole, east, north) for hole in holes):
                points.append((east, north))
        east, north = np.array(points).T
        lat, lon, _ = pymap3d.enu2geodetic(east, north, 0.0, *ORIGIN)
        ground = np.full(count, ORIGIN[2])
        self.places = np.column_stack(pymap3d.geodetic2ecef(lat, lon, ground))
        self.vector_to = np.zeros(count, dtype=bool)

    def ptz(self, world, mast_m=2.0):
        state, gimbal = world.truth(), world.gimbal
        gimbal.move()
        here = state.position
        east, north, up = pymap3d.ecef2enu(
            *self.places.T, here.latitude_deg, here.longitude_deg, here.altitude_m + mast_m
        )
        heading = math.pi / 2 - state.yaw_rad + gimbal.pan
        level = east * math.sin(heading) + north * math.cos(heading)
        ahead = level * math.cos(gimbal.tilt) + up * math.sin(gimbal.tilt)
        right = east * math.cos(heading) - north * math.sin(heading)
        above = up * math.cos(gimbal.tilt) - level * math.sin(gimbal.tilt)
        wide, high = (math.tan(angle / 2) / gimbal.zoom for angle in VIEW)
        self.vector_to |= (ahead > 0) & (abs(right) <= wide * ahead) & (abs(above) <= high * ahead)

    @property
    def share(self):
        return float(self.vector_to.mean())


def scan(ring, gimbal=None, moves=lambda _: {}, domain="ground", holes=(), within_s=900, **options):
    """Scan the area; returns the report, the witness and how long it took, in s."""
    witness = options.pop("witness", None) or Witness(ring, holes)
    parameters = options.pop("parameters", {})

    async def main(world):
        began = world.seconds
        target = area(*ring, holes=holes)
        await world.bench.start("r1.b1", "ptz_scan_polygon", CAMERA, area=target, **parameters)
        while not any(state.terminal for state in world.bench.states_of("r1.b1")):
            assert world.seconds - began < within_s
            witness.ptz(world)
            await world.clock.sleep(0.05)
        return world.bench.of("r1.b1")[-1], witness, world.seconds - began

    gimbal = gimbal or Gimbal()
    settings = {"tilt": ["-90 deg", "90 deg"], "view": ["60 deg", "34 deg"], "zoom_max": 30}
    return play(main, gimbal, moves, domain, reach=settings, **options)


def zoomed(level, **reach):
    gimbal = Gimbal(zoom_max=30.0, **reach)
    gimbal.zoom = level
    return gimbal


AIRBORNE = {"up": 60.0, "altitude_above_home_m": 60.0}
LOW = {"up": 30.0, "altitude_above_home_m": 30.0}


@pytest.mark.parametrize(
    ("ring", "zoom", "where", "domain"),
    [
        pytest.param(SQUARE, 1.0, {}, "ground", id="square"),
        pytest.param(SQUARE, 8.0, AIRBORNE, "air", id="zoomed in", marks=pytest.mark.long),
        pytest.param(CONCAVE, 4.0, LOW, "air", id="concave", marks=pytest.mark.long),
        pytest.param(FIELD, 2.0, AIRBORNE, "air", id="field", marks=pytest.mark.long),
        pytest.param(AROUND, 1.0, AIRBORNE, "air", id="all around from above"),
        pytest.param(AROUND, 1.0, {}, "ground", id="all around", marks=pytest.mark.long),
    ],
)
def test_at_least_99_percent_of_an_area_is_seen(ring, zoom, where, domain):
    end, witness, _ = scan(ring, zoomed(zoom), lambda _: where, domain)
    assert end.state is BehaviorState.SUCCEEDED, end
    assert witness.share >= 0.99


def test_a_vehicle_that_drives_past_sees_all_of_the_area_all_the_same():
    def moves(t):
        return {**AIRBORNE, "east": -80 + 6 * t, "velocity": (6, 0, 0), "yaw": 0.05 * t}

    end, witness, took_s = scan(SQUARE, zoomed(6.0), moves, "air")
    assert end.state is BehaviorState.SUCCEEDED, end
    assert took_s > 5, "it took long enough to have moved"
    assert witness.share >= 0.99


def test_a_vehicle_that_leans_sees_all_of_the_area_too():
    """The camera's rows are not level then. Seen is what `MountFrame.axes` has in the picture."""

    def moves(t):
        return {**AIRBORNE, "roll_rad": rad(12), "pitch_rad": rad(-8) + 0.05 * math.sin(t)}

    class Leaning(Witness):
        def ptz(self, world, mast_m=2.0):
            state, gimbal = world.truth(), world.gimbal
            gimbal.move()
            pose = VehiclePose(state.position, state.yaw_rad, state.roll_rad, state.pitch_rad)
            here = camera_pose(pose, Mounting(up_m=mast_m), stabilized=False)
            axes = here.mount_frame.axes(gimbal.pan, gimbal.tilt)
            self.vector_to |= (
                FieldOfView(*VIEW).zoomed(gimbal.zoom).holds(axes, here.vector_to(self.places))
            )

    end, witness, _ = scan(SQUARE, zoomed(4.0), moves, "air", witness=Leaning(SQUARE))
    assert end.state is BehaviorState.SUCCEEDED, end
    assert witness.share >= 0.99


def test_a_hole_of_the_area_need_not_be_seen():
    ring = ((-150, 50), (150, 50), (150, 200), (-150, 200))
    hole = ((-90, 60), (90, 60), (90, 190), (-90, 190))
    end, witness, took_s = scan(ring, zoomed(2.0), lambda _: AIRBORNE, "air", holes=(hole,))
    assert end.state is BehaviorState.SUCCEEDED
    assert witness.share >= 0.99
    assert took_s < scan(ring, zoomed(2.0), lambda _: AIRBORNE, "air")[2]


def test_more_overlap_means_more_rows():
    quick = scan(SQUARE, zoomed(4.0), lambda _: AIRBORNE, "air", parameters={"overlap": 0.0})
    slow = scan(SQUARE, zoomed(4.0), lambda _: AIRBORNE, "air", parameters={"overlap": 0.6})
    assert slow[2] > 1.5 * quick[2]
    assert min(slow[1].share, quick[1].share) >= 0.99


def test_speed_is_that_of_the_turning():
    slow = scan(SQUARE, zoomed(2.0), lambda _: AIRBORNE, "air", parameters={"speed": rad(4)})
    quick = scan(SQUARE, zoomed(2.0), lambda _: AIRBORNE, "air", parameters={"speed": rad(12)})
    assert slow[2] > 1.8 * quick[2]
    assert quick[1].share >= 0.99


def test_a_held_scan_goes_on_with_what_is_left():
    witness = Witness(SQUARE)
    alone = scan(SQUARE, zoomed(3.0), lambda _: AIRBORNE, "air")[2]

    async def main(world):
        began, held = world.seconds, 0.0
        target = area(*SQUARE)
        await world.bench.start("r1.b1", "ptz_scan_polygon", CAMERA, area=target)
        while not any(state.terminal for state in world.bench.states_of("r1.b1")):
            witness.ptz(world)
            await world.clock.sleep(0.05)
            if not held and witness.share > 0.5:
                held = 30.0
                await world.bench.arbiter.hold(CAMERA)
                await world.clock.sleep(held)
                await world.bench.arbiter.resume(CAMERA)
        assert world.bench.states_of("r1.b1")[-1] is BehaviorState.SUCCEEDED
        assert world.seconds - began - held < 1.1 * alone, "it did not begin anew"
        assert witness.share >= 0.99

    play(
        main,
        zoomed(3.0),
        lambda _: AIRBORNE,
        "air",
        reach={"tilt": ["-90 deg", "90 deg"], "zoom_max": 30},
    )


def test_an_area_that_is_out_of_reach_is_rejected_with_how_much_is_in_reach():
    gimbal = Gimbal(pan_rad=(rad(-60), rad(60)), tilt_rad=(rad(-90), rad(0)))
    end, _, _ = scan(AROUND, gimbal)
    assert end.state is BehaviorState.REJECTED
    assert gimbal.told is None, "nothing has turned"
    assert end.reason.startswith("only "), end.reason
    assert end.reason.endswith("of the area is within reach: pan -60 to 60, tilt -90 to 0 deg")


def test_an_area_beyond_the_horizon_is_rejected():
    far = ((0, 30_000), (100, 30_000), (100, 30_100), (0, 30_100))
    end, _, _ = scan(far, Gimbal())
    assert end.state is BehaviorState.REJECTED
    assert end.reason == "100 % of the area is beyond the horizon of the camera"


def test_a_vehicle_that_turns_its_blind_side_to_the_area_fails_and_says_why():
    gimbal = zoomed(8.0, pan_rad=(rad(-60), rad(60)))

    def moves(t):
        return {**AIRBORNE, "yaw": math.pi / 2 + (math.pi if t > 4 else 0.0)}

    end, witness, _ = scan(SQUARE, gimbal, moves, "air")
    assert end.state is BehaviorState.FAILED
    assert end.reason.startswith("out of reach for 10 s: pan ")
    assert witness.share < 0.99


# --- sectors ------------------------------------------------------------------------------------


def sector(parameters, gimbal=None, moves=lambda _: {}, **settings):
    """Scan a sector; the report, and the headings (deg) that were looked at meanwhile."""

    async def main(world):
        headings = []
        await world.bench.start("r1.b1", "ptz_scan_sector", CAMERA, **parameters)
        while not any(state.terminal for state in world.bench.states_of("r1.b1")):
            world.gimbal.move()
            yaw = world.truth().yaw_rad
            headings.append(math.degrees(math.pi / 2 - yaw + world.gimbal.pan))
            await world.clock.sleep(0.05)
        return world.bench.of("r1.b1")[-1], headings, world

    return play(main, gimbal or Gimbal(), moves, **settings)


def test_a_sector_is_swept_from_its_nearer_edge_to_the_other():
    end, headings, world = sector({"heading": rad(60), "sector": rad(80), "elevation": rad(5)})
    assert end.state is BehaviorState.SUCCEEDED
    assert (min(headings), max(headings)) == pytest.approx((0, 100), abs=1.5)
    assert headings[-1] == pytest.approx(100, abs=1.5)
    assert world.gimbal.tilt == pytest.approx(rad(5), abs=rad(0.5))


def test_a_sector_stays_in_the_world_while_the_vehicle_turns():
    _, headings, world = sector(
        {"heading": 0.0, "sector": rad(60), "elevation": 0.0, "speed": rad(6)},
        moves=lambda t: {"yaw": math.pi / 2 + 0.1 * t},
    )
    assert max(headings) - min(headings) == pytest.approx(60, abs=3)
    assert world.seconds > 9


def test_a_whole_turn_is_swept_by_a_camera_with_stops_too():
    end, headings, _ = sector({"heading": rad(90), "sector": math.tau, "elevation": 0.0})
    assert end.state is BehaviorState.SUCCEEDED
    seen = {round(heading) % 360 // 10 for heading in headings}
    assert seen == set(range(36))


def test_an_endless_camera_sweeps_a_whole_turn_without_turning_back():
    end, headings, _ = sector(
        {"heading": 0.0, "sector": math.tau, "elevation": 0.0},
        Gimbal(endless=True),
        reach={"endless": True},
    )
    assert end.state is BehaviorState.SUCCEEDED
    steps = [math.remainder(b - a, 360) for a, b in pairwise(headings)]
    assert min(steps) > -1.0
    assert sum(steps) == pytest.approx(360, abs=2)


def test_a_sector_beyond_the_stops_is_rejected():
    gimbal = Gimbal(pan_rad=(rad(-60), rad(60)))
    end, _, _ = sector({"heading": rad(90), "sector": rad(80), "elevation": 0.0}, gimbal)
    assert end.state is BehaviorState.REJECTED
    assert end.reason == (
        "heading 78 deg is out of reach: pan 78 deg is beyond its stops, -60 to 60 deg"
    )


def test_without_an_elevation_it_looks_as_high_as_before():
    gimbal = Gimbal()
    gimbal.tilt = rad(-12)
    sector({"heading": 0.0, "sector": rad(60)}, gimbal)
    assert gimbal.tilt == pytest.approx(rad(-12), abs=rad(0.5))


def test_what_is_left_of_a_sector_is_reported_to_its_far_edge():
    async def main(world):
        sector = {"heading": rad(90), "sector": rad(80)}
        end = await world.do("ptz_scan_sector", **sector, speed=rad(10))
        assert end.state is BehaviorState.SUCCEEDED, end
        return [each.remaining for each in world.bench.of("r1.b1")]

    said = [each for each in play(main, Gimbal()) if each is not None]
    left = [float(each["sector"].removesuffix(" deg")) for each in said]
    middles = [float(each["heading"].removesuffix(" deg")) for each in said]
    assert 5 < len(left) < 40
    assert left == sorted(left, reverse=True)
    far = {round(middle + rest / 2, 1) for middle, rest in zip(middles, left, strict=True)}
    far |= {round(middle - rest / 2, 1) for middle, rest in zip(middles, left, strict=True)}
    assert far & {50.0, 130.0}, "one end of what is left is always an edge of the sector"


def scan_until(silent_at_s, ring, witness):
    """Scan an area with a camera that falls silent; returns what it has left."""

    async def main(world):
        await world.bench.start("r1.b1", "ptz_scan_polygon", CAMERA, area=area(*ring))
        while world.seconds < silent_at_s:
            witness.ptz(world)
            await world.clock.sleep(0.05)
        world.gimbal.audible = False
        return (await world.bench.ended("r1.b1", 60)).remaining

    reach = {"tilt": ["-90 deg", "90 deg"], "view": ["60 deg", "34 deg"], "zoom_max": 30}
    return play(main, Gimbal(), reach=reach)


def test_another_camera_scans_what_one_that_was_lost_has_left():
    witness = Witness(FIELD)
    left = scan_until(3.0, FIELD, witness)
    done = witness.share
    rest = parse_geojson(left["area"])
    assert 0.1 < done < 0.9
    east, north, _ = pymap3d.geodetic2enu(
        *np.array([(*corner[:2], ORIGIN[2]) for corner in rest.rings[0]]).T, *ORIGIN
    )
    ring = tuple(zip(east.tolist(), north.tolist(), strict=True))
    end, _, _ = scan(ring[:-1], witness=witness)
    assert end.state is BehaviorState.SUCCEEDED
    assert witness.share > 0.98


def test_all_is_left_of_an_area_that_is_not_convex():
    assert scan_until(3.0, CONCAVE, Witness(CONCAVE)) is None
