"""What somebody has broken in a vehicle (`sim.faults`); a reboot does not repair it."""

from dataclasses import dataclass, field

from m2pem_plugin_mavlink.sim.command import Result


@dataclass(slots=True)
class Refusal:
    """A command that is not obeyed. `result` None: not even answered; `times` None: always."""

    result: Result | None = Result.FAILED
    text: str = ""
    times: int | None = None


@dataclass(slots=True)
class Troubles:
    """`gps_lost`: no satellites; `arming`: why it does not arm; `commands`: by MAV_CMD;
    `camera_full`: there is no room for another picture."""

    gps_lost: bool = False
    camera_full: bool = False
    arming: str | None = None
    commands: dict[int, Refusal] = field(default_factory=dict)

    def refusal_of(self, command: int) -> Refusal | None:
        """Whether that command is refused this time."""
        refusal = self.commands.get(command)
        if refusal is None or refusal.times is None:
            return refusal
        refusal.times -= 1
        if refusal.times <= 0:
            del self.commands[command]
        return refusal
