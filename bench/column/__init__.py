"""How well a team over ROS kept its spacing, and its camera its target: `python -m bench.column`.

It believes nobody: where vehicles are it hears on their odometry, where the camera looks from its
joints, and what should have been from the mission's commands. `listening` collects, `series`
brings it to one time, `spacing` and `pointing` measure.
"""
