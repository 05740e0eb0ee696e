"""What an autopilot is: its version and what it can do (AUTOPILOT_VERSION; mavlink.io,
messages/common.html and services/parameter.html for how it carries parameters)."""

from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.intervals import RequestMessage
from m2pem_plugin_mavlink.microservices.parameter_values import ParameterEncoding
from m2pem_plugin_mavlink.protocol.messages import Address, Message

_STAGES: dict[int, str] = {
    dialect.FIRMWARE_VERSION_TYPE_DEV: "-dev",
    dialect.FIRMWARE_VERSION_TYPE_ALPHA: "-alpha",
    dialect.FIRMWARE_VERSION_TYPE_BETA: "-beta",
    dialect.FIRMWARE_VERSION_TYPE_RC: "-rc",
    dialect.FIRMWARE_VERSION_TYPE_OFFICIAL: "",
}


@dataclass(frozen=True, slots=True)
class AutopilotVersion:
    """`version`: major, minor, patch; `stage`: "" for a release, "-dev", "-beta" and so on;
    `capabilities`: MAV_PROTOCOL_CAPABILITY; `uid`: of the hardware, 0 where it has none."""

    version: tuple[int, int, int]
    stage: str
    capabilities: int
    uid: int

    def __str__(self) -> str:
        return ".".join(str(each) for each in self.version) + self.stage

    def has(self, capability: int) -> bool:
        """Whether it has a MAV_PROTOCOL_CAPABILITY."""
        return bool(self.capabilities & capability)

    @property
    def parameter_encoding(self) -> ParameterEncoding | None:
        """How it carries whole numbers in parameters; None: it does not say."""
        if self.has(dialect.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE):
            return ParameterEncoding.BYTEWISE
        if self.has(dialect.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST):
            return ParameterEncoding.C_CAST
        return None


class ReadAutopilotVersion(RequestMessage[AutopilotVersion]):
    """The version of an autopilot's firmware, and what it can do."""

    def __init__(self, target: Address) -> None:
        super().__init__(target, "AUTOPILOT_VERSION", version_of)


def version_of(message: Message) -> AutopilotVersion:
    """What an AUTOPILOT_VERSION says."""
    major, minor, patch, stage = message.flight_sw_version.to_bytes(4, "big")
    words = _STAGES.get(stage, f"-{stage}")
    return AutopilotVersion((major, minor, patch), words, message.capabilities, message.uid)
