"""The m2pem node of a camera that turns (docs/ros.md, "Payloads with a node"). It needs ROS."""
