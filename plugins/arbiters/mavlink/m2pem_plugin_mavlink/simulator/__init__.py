"""A simulated autopilot: real MAVLink 2 over UDP, as ArduPilot speaks it (`m2pem sim mavlink`).

It encodes and parses with pymavlink's own `MAVLink` class, so that it shares nothing with the code
that it is to test.

- `specification` what a vehicle is; `simulator` runs many of them, and shows the physical truth;
  `server` a vehicle's UDP socket; `wire` carries its frames (faults of links go there);
  `command_line` is `m2pem sim mavlink`.
- `autopilot` one vehicle without I/O, made of parts (`component`): `texts`, `estimator`, `battery`,
  `home`, `modes`, `arming`, `guided` (setpoints), `parameters`, `streams`, `reports`, `identity`,
  `missions` (`plan`, `protocol`, `progress`, `execution`), `commands` (`dispatch`, `motion`,
  `payload`, `system`). A part names the commands and messages it takes, the reports it makes, why
  the vehicle must not be armed (`refusals`) and where it must not go (`forbids`).
- `firmware` how ArduPilot and others differ: modes, parameters, wording, and parts of their own.
- `maneuvers` what the vehicle does in a mode: it makes a demand (`setpoints`); `dynamics` turn that
  into movement of the `body`; `geometry` is where that is on Earth.
- `peers` and `command`: who speaks, and what a command is; `log`: what really happened.
"""
