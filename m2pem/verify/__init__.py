"""Verification of a mission before it moves anything.

`translate.translate(mission, fleet)` gives the mission as a Petri net (`net.petri_net`).
`search.explore` explores its state space, or `spin` does; `properties` and `requirements` say what
that means for the mission's author, and `report` writes it down. `check.check` does all of that.
"""
