"""A simulated autopilot: real MAVLink 2 over UDP, as ArduPilot and PX4 do (`m2pem sim mavlink`).

It encodes and parses with pymavlink's own `MAVLink` class, so it shares no code with what it tests.

- `simulator` runs many vehicles, and shows their true state. `specification` describes a vehicle;
  `server` is its UDP socket; `faults` are injected faults; `command_line` is the command.
- `autopilot` is one vehicle without I/O, made of components. A component names the commands and
  messages that it handles, the reports that it makes, and reasons not to arm: `arming`, `modes`,
  `sensors`, `home`, `parameters`, `streams`, `reports`, `identity`, `commands`, `motion_commands`,
  `missions`, `failsafes`, `fence`, `gimbal`, `camera`.
- `interfaces` is what components see of the autopilot and of each other; they import nothing else
  of it. `messages` has senders and commands.
- `firmware` is how ArduPilot and PX4 differ: modes, parameters, texts, own components.
- `maneuvers` and `px4_maneuvers` choose a motion setpoint in each mode; `dynamics` turns it into
  motion; `geometry` converts to positions on Earth.
"""
