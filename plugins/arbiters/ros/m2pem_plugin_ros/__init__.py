"""ROS 2 vehicles: on land and on water (docs/ros.md)."""
