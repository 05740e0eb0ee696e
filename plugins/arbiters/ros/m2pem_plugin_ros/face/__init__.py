"""The face `ros`: the whole fleet on topics, tf, actions and services (docs/ros-face.md)."""
