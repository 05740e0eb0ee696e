"""The m2pem node that runs on a vehicle or a payload (docs/ros.md, "Write your own node")."""
