"""The next step of a body that keeps up with a target."""

from m2pem.simulation.domains import STANDING_LOAD
from m2pem.simulation.executions import Aim, Part
from m2pem.simulation.gimbals import aimed
from m2pem.simulation.launch import Launcher
from m2pem.simulation.payloads import SimPayload
from m2pem.simulation.pursuit import STEP_S, Pursuit, steer
from m2pem.simulation.track import US_PER_S, Plan
from m2pem.simulation.vehicles import SimVehicle

STEP_US = round(STEP_S * US_PER_S)


def next_step(part: Part, launcher: Launcher, now_us: int) -> None:
    """Give the body its motion until it looks again; a target that is not heard is waited for."""
    body = part.body
    if isinstance(body, SimVehicle) and isinstance(part.chase, Pursuit):
        pose = body.pose(now_us)
        chase = part.chase
        station, velocity = pose.place, (0.0, 0.0, 0.0)
        if (target := launcher.whereabouts(chase.target, now_us)) is not None:
            station, velocity = chase.station(target), target.velocity
        phase = steer(
            body.kinematics,
            pose,
            station,
            velocity,
            speed_m_s=chase.speed_m_s,
            standing_load=1.0 if body.aloft(now_us) else STANDING_LOAD,
        )
        body.take(Plan([phase]), now_us)
    elif isinstance(body, SimPayload) and isinstance(part.chase, Aim):
        carrier = launcher.whereabouts(body.carrier, now_us)
        place = part.chase.place
        if part.chase.vehicle:
            target = launcher.whereabouts(part.chase.vehicle, now_us)
            place = target.place if target is not None else place
            carrier = carrier if target is not None else None
        if carrier is None:
            body.stop(now_us)
        else:
            gimbal = body.settings.gimbal
            body.take(Plan([aimed(gimbal, body.look(now_us), carrier, place)]), now_us)
