"""Simulated pan-tilt heads with cameras, over ROS (`m2pem sim ros-cameras`).

`head` is how one moves, `mosaic` what its camera shows; `camera` has its topics; `fleet` reads
which there are, and `command_line` runs them.
"""
