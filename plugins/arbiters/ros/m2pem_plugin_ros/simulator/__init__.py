"""Simulated vehicles that speak ROS 2 as real ones do (`m2pem sim ros`), always on 127.0.0.1.

- `specification` what a vehicle is; `fleet` reads it from a fleet file, `words` from the words of a
  person; `command_line` is `m2pem sim ros`; `clock` is its time.
- `vehicle` one vehicle without I/O, made of `body` (how it moves), `odometer` (where it believes to
  be), `battery` and `detector`.
- `ports` a vehicle's topics; `guard` what stands between a vehicle's nodes and ROS; `ways` what
  steers a vehicle on board: nothing, an m2pem node, or Nav2 (`nav2`); `host` puts it together, and
  ends and begins its nodes; `simulation` moves all vehicles on.
- `faults` what goes wrong on request, in words.
"""
