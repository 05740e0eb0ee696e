"""The m2pem node that runs on a vehicle or a payload (docs/ros-nodes.md)."""
