"""Simulated vehicles that speak ROS 2 as real ones do (`m2pem sim ros`), always on 127.0.0.1.

- `command_line` is the command; `fleet` reads the vehicles of a fleet file; `specification`
describes a vehicle.

- `vehicle` is one vehicle without I/O, with `dynamics` and `sensors`.

- `host` runs the nodes of a vehicle: its `topics`, and its `onboard_control`: nothing, an m2pem
node, or Nav2 (`nav2`). `traffic` filters the messages of the nodes.

- `simulation` advances all vehicles. `faults` are read from text and applied to them.
"""
