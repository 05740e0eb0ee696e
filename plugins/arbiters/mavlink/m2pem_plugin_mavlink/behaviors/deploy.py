"""The behavior `deploy`: servos, relays, actuators of PX4 and grippers."""

import math

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.behaviors.behavior import BehaviorContext, SetBehavior
from m2pem_plugin_mavlink.behaviors.parameters import VehicleParameters

KINDS = "'servo N', 'relay N', 'actuator N', 'gripper' or 'gripper N'"

_PULSE_US = (500.0, 2500.0)


class Deploy(SetBehavior):
    """Set a servo (its output, in microseconds), a relay (0 or 1), an actuator of PX4 (-1 to 1), or
    have a gripper release (0, the default) or grab (1). A number alone is that of a servo."""

    name = "deploy"

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        parameters = VehicleParameters(context)
        self._called = parameters.text("actuator")
        meant = context.actuators.get(self._called, self._called)
        words = meant.replace(":", " ").lower().split()
        self._kind, self._number = _read(words)
        self._value = parameters.number("value")

    def refusal(self) -> str:
        """Check that there is such an actuator, and that it accepts the value."""
        if not self._kind:
            names = ", ".join(self.context.actuators)
            known = f"{names}; or " if names else ""
            return f"parameter 'actuator': there is no '{self._called}': write {known}{KINDS}"
        if self._kind == "servo" and self._value is None:
            return "a servo needs the parameter 'value': its pulse in microseconds"
        low, high = {
            "servo": _PULSE_US,
            "relay": (0.0, 1.0),
            "gripper": (0.0, 1.0),
            "actuator": (-1.0, 1.0),
        }[self._kind]
        if self._value is not None and not low <= self._value <= high:
            return f"parameter 'value': a {self._kind} takes {low:g} to {high:g}"
        return ""

    async def begin(self) -> None:
        driver, number = self.vehicle.driver, float(self._number)
        if self._kind == "servo":
            await driver.command(dialect.MAV_CMD_DO_SET_SERVO, number, self._value or 0.0)
        elif self._kind == "relay":
            on = 1.0 if self._value is None else round(self._value)
            await driver.command(dialect.MAV_CMD_DO_SET_RELAY, number, on)
        elif self._kind == "gripper":
            await driver.command(dialect.MAV_CMD_DO_GRIPPER, number, round(self._value or 0.0))
        else:
            values = [math.nan] * 6
            values[self._number - 1] = 1.0 if self._value is None else self._value
            await driver.command(dialect.MAV_CMD_DO_SET_ACTUATOR, *values, 0.0)


def _read(words: list[str]) -> tuple[str, int]:
    """Return kind and number of an actuator; ("", 0) if the words name none."""
    match words:
        case [number] if number.isdecimal():
            return "servo", int(number)
        case ["gripper"]:
            return "gripper", 1
        case ["actuator", number] if number.isdecimal() and 1 <= int(number) <= 6:
            return "actuator", int(number)
        case [("servo" | "relay" | "gripper") as kind, number] if number.isdecimal():
            return kind, int(number)
    return "", 0
