"""The ways to reach a camera that turns: over ROS, MAVLink and ONVIF."""
