"""What an arbiter, operator control unit or face can do beyond its protocol: its class declares it.

A class declares it in its attribute `capabilities`; one without that attribute has none. It is
checked when the plugin registers the class, and again on the object of a factory that is no class.
"""

from collections.abc import Mapping
from dataclasses import dataclass

ARBITER_METHODS = {
    "adjusts": "adjust",
    "sights": "sight",
    "addresses": "addresses",
    "reclaims": "reclaim",
    "detects": "detectors",
    "fences": "fence",
}
"""The member that an arbiter must have to declare a capability, by the capability."""

REPLACED = {"takes_one_vehicle": "one_vehicle"}
"""The capability of an arbiter that a class attribute declared before 0.2.0."""

REPLACED_OF_OCU = {"takes_terminal": "takes_terminal", "imports": "imports"}
"""The same of operator control units."""


@dataclass(frozen=True, slots=True)
class ArbiterCapabilities:
    """What an arbiter can do beyond `m2pem.api.Arbiter`.

    `one_vehicle`: no request may be for several vehicles; where a mission has several do the same,
    each of them is asked for its own. `adjusts`, `sights`, `addresses`, `reclaims`, `detects`,
    `fences`: it has what `AdjustingArbiter`, `SightedArbiter`, `AddressedArbiter`,
    `ReclaimingArbiter`, `DetectingArbiter` or `FencingArbiter` describes. `straight`: ground
    vehicles move along straight lines between waypoints, and plan no way around what is there;
    other vehicles are taken to do so anyway.
    """

    one_vehicle: bool = False
    adjusts: bool = False
    sights: bool = False
    addresses: bool = False
    reclaims: bool = False
    detects: bool = False
    fences: bool = False
    straight: bool = False


@dataclass(frozen=True, slots=True)
class OcuCapabilities:
    """What the command line must know of an operator control unit before it makes one.

    `takes_terminal`: it draws on the whole terminal. Then the command line prints nothing while it
    serves, and uses `plain` instead where there is no terminal. `imports`: names of modules that
    take long to import. They are imported before an executive exists, as an import in its event
    loop would delay STOP. `stands_by`: it has what `m2pem.api.ocu.StandbyOcu` describes.
    """

    takes_terminal: bool = False
    imports: tuple[str, ...] = ()
    stands_by: bool = False


@dataclass(frozen=True, slots=True)
class FaceCapabilities:
    """What the command line must know of a face before it makes one. `imports`: as above."""

    imports: tuple[str, ...] = ()


def arbiter_capabilities(arbiter: object) -> ArbiterCapabilities:
    """Return what an arbiter, or its class, declares; nothing if it declares nothing."""
    declared = getattr(arbiter, "capabilities", None)
    return declared if isinstance(declared, ArbiterCapabilities) else ArbiterCapabilities()


def ocu_capabilities(factory: object) -> OcuCapabilities:
    """Return what an operator control unit's class declares; nothing if it declares nothing."""
    declared = getattr(factory, "capabilities", None)
    return declared if isinstance(declared, OcuCapabilities) else OcuCapabilities()


def face_capabilities(factory: object) -> FaceCapabilities:
    """Return what a face's class declares; nothing if it declares nothing."""
    declared = getattr(factory, "capabilities", None)
    return declared if isinstance(declared, FaceCapabilities) else FaceCapabilities()


def arbiter_problem(arbiter: object) -> str:
    """Return what is wrong in the declaration of an arbiter or of its class; "" if nothing is."""
    if problem := _problem(arbiter, ArbiterCapabilities, REPLACED):
        return problem
    if isinstance(getattr(arbiter, "capabilities", None), property):
        return ""
    declared = arbiter_capabilities(arbiter)
    for capability, member in ARBITER_METHODS.items():
        if getattr(declared, capability) and not hasattr(arbiter, member):
            return f"its `capabilities` say {capability}=True, but it has no `{member}`"
        # Undeclared, a vehicle would not be stopped after a lost link, or not be locked by address.
        if hasattr(arbiter, member) and not getattr(declared, capability):
            return (
                f"it has `{member}`, but its `capabilities` do not say {capability}=True: "
                "m2pem would never call it"
            )
    return ""


def ocu_problem(factory: object) -> str:
    """Return what is wrong in the declaration of an operator control unit; "" if nothing is."""
    if problem := _problem(factory, OcuCapabilities, REPLACED_OF_OCU):
        return problem
    for member in ("page", "stand_by"):
        if ocu_capabilities(factory).stands_by and not hasattr(factory, member):
            return f"its `capabilities` say stands_by=True, but it has no `{member}`"
    return ""


def face_problem(factory: object) -> str:
    """Return what is wrong in the declaration of a face; "" if nothing is."""
    return _problem(factory, FaceCapabilities, {})


def _problem(declaring: object, kind: type, replaced: Mapping[str, str]) -> str:
    declared = getattr(declaring, "capabilities", None)
    # A property of a class: its objects declare, each for itself.
    if not (declared is None or isinstance(declared, (kind, property))):
        return f"its `capabilities` are {declared!r}, not an m2pem.api.{kind.__name__}"
    for attribute, capability in replaced.items():
        if hasattr(declaring, attribute):
            return (
                f"its attribute `{attribute}` has no effect since 0.2.0: declare "
                f"`capabilities = {kind.__name__}({capability}=...)`"
            )
    return ""
