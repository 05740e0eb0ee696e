"""Simulated pan-tilt units with cameras, over ROS (`m2pem sim ros-cameras`).

`gimbal` is the motion of a unit, `image` the picture of its camera, and `camera` has the topics.
`fleet` reads the cameras of a fleet file, and `command_line` runs them.
"""
