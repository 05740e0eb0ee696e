"""The paper's Detector: waits until a detector payload finds something (sections 4.1 and 4.4)."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta

from m2pem.api.service import ServiceContext, ServiceError
from m2pem.api.telemetry import Detection, PayloadState
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class Detector:
    """Ends with the first detection that is published after its task started.

    It listens to the payloads that its roles name (a role that names a vehicle: to the detector
    payloads on it), and without roles to every detector payload of the fleet. It writes what was
    found (`detection.type`), the payload that found it (`detection.source`), where, as [latitude
    and longitude in degrees, altitude in metres above mean sea level] (`detection.position`), and
    when, as ISO 8601 in UTC (`detection.time`). It takes no properties.
    """

    writes: Sequence[str] = (
        "detection.type",
        "detection.source",
        "detection.position",
        "detection.time",
    )

    async def run(
        self,
        context: ServiceContext,
        roles: Mapping[str, ResourceId],
        properties: Mapping[str, Value],
    ) -> Mapping[str, Value]:
        """Wait for a detection.

        Raises:
            ServiceError: FAILED, when there will be no more telemetry.
        """
        # Large: one burst of a big fleet must not push a detection out before we run.
        states = context.bus.subscribe(size=10_000)
        payloads = _listened_to(roles, context.detectors)
        if not payloads:
            context.logger.warning(
                "Detector waits for ever: %s",
                f"no detector payload on {', '.join(roles.values())}"
                if roles
                else "no payload of the fleet is marked `detector: true`",
            )
        async for state in states:
            if isinstance(state, PayloadState) and state.detections and state.resource in payloads:
                return _written(state.detections[0])
        raise ServiceError("FAILED", "telemetry ended before anything was detected")


def _listened_to(
    roles: Mapping[str, ResourceId], detectors: tuple[ResourceId, ...]
) -> frozenset[ResourceId]:
    if not roles:
        return frozenset(detectors)
    payloads = {resource for resource in roles.values() if "/" in resource}
    vehicles = {resource for resource in roles.values() if "/" not in resource}
    return frozenset(payloads | {d for d in detectors if d.partition("/")[0] in vehicles})


def _written(detection: Detection) -> dict[str, Value]:
    position = detection.position
    time = _EPOCH + timedelta(microseconds=detection.time_us)
    return {
        "detection.type": detection.type,
        "detection.source": detection.source,
        "detection.position": [
            position.latitude_deg,
            position.longitude_deg,
            position.altitude_m,
        ],
        "detection.time": time.isoformat(timespec="microseconds").replace("+00:00", "Z"),
    }
