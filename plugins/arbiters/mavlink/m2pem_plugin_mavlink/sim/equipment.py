"""What a vehicle carries, whatever its firmware."""

from m2pem_plugin_mavlink.sim.camera import Camera
from m2pem_plugin_mavlink.sim.fence.fence import Fence
from m2pem_plugin_mavlink.sim.gimbal.gimbal import Gimbal
from m2pem_plugin_mavlink.sim.part import Part
from m2pem_plugin_mavlink.sim.specification import Kind, VehicleSpec


def equipment_of(spec: VehicleSpec) -> tuple[type[Part], ...]:
    """Its parts."""
    gimbal = spec.kind is Kind.COPTER if spec.gimbal is None else spec.gimbal
    parts: list[type[Part]] = [Fence]
    if gimbal:
        parts.append(Gimbal)
    if spec.camera:
        parts.append(Camera)
    return tuple(parts)
