"""Proving a mission before it moves anything.

`derive.derive(mission, fleet)` gives the mission's rules (`system.System`); `explore.explore`
searches what they can lead to; `properties` says what that means for the mission's author.
"""
