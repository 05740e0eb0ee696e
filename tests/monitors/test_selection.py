"""What a run is monitored for, as its records say it."""

from m2pem.monitors.selection import monitored
from m2pem.verify.ltl import parse
from m2pem.verify.ltl.formula import Active, Next
from m2pem.verify.requirements import Requirement


def test_a_requirement_is_about_the_elements_that_it_names_also_within_bounds_of_time() -> None:
    said = "[](completed(A) -> <>[0 s, 30 s] (active(B) && <>[0 s, 5 s] active(C))) && active(A)"
    (found,) = monitored([Requirement("soon", parse(said), "")])
    assert found.elements == ("A", "B", "C")


def test_what_is_not_to_be_monitored_and_what_is_about_steps_is_left_out() -> None:
    asked = Requirement("asked", parse("<> active(A)"), "")
    left = Requirement("left", parse("<> active(A)"), "", monitor=False)
    step = Requirement("step", Next(Active("A")), "")
    assert [each.id for each in monitored([left, step, asked])] == ["asked"]
