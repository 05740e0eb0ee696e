"""What the state of a vehicle says: readiness, pauses, orders, errors."""

from collections.abc import Collection

from msgspec import UNSET

from m2pem_plugin_vda5050.messages import ActionState, Error, State

ID_PREFIX = "m2pem-"
"""The ids of instant actions with which m2pem controls a vehicle begin with this."""

COMMANDED = ("AUTOMATIC", "SEMIAUTOMATIC")
"""In these operating modes, the master control commands the vehicle."""

ENDED = ("FINISHED", "FAILED")


def text_of(value: object, longest: int = 200) -> str:
    """Return a text of a vehicle, without control characters and not too long."""
    text = "" if value is UNSET else str(value)
    clean = "".join(each if each.isprintable() else " " for each in text[: longest + 1])
    return clean if len(clean) <= longest else f"{clean[:longest]}..."


def describe(error: Error) -> str:
    """Return an error for people."""
    said = text_of(error.error_description)
    name = text_of(error.error_type, 60)
    return f"{name}: {said}" if said else name


def action_state(state: State, action_id: str) -> ActionState | None:
    """Return the state of an action; None: the vehicle does not have it."""
    found = (each for each in reversed(state.action_states) if each.action_id == action_id)
    return next(found, None)


def is_executing(state: State) -> bool:
    """Whether the vehicle still executes an order: it has nodes left, or an action of the order
    goes on."""
    going = any(
        each.action_status not in ENDED and not _is_instant(each) for each in state.action_states
    )
    return bool(state.node_states or state.edge_states) or going


def _is_instant(state: ActionState) -> bool:
    return state.action_id.startswith(ID_PREFIX)


def is_paused(state: State) -> bool:
    """Whether the vehicle is paused. `paused` is optional: without it, the last pause counts."""
    if state.paused is not UNSET:
        return bool(state.paused)
    return _last_pause(state) == "startPause"


def is_paused_by_us(state: State) -> bool:
    """Whether m2pem paused the vehicle, and not a person at it or another master control."""
    return is_paused(state) and _last_pause(state) == "startPause"


def _last_pause(state: State) -> str:
    kinds = ("startPause", "stopPause")
    for each in reversed(state.action_states):
        kind = pause_kind(each)
        if kind in kinds and each.action_status == "FINISHED":
            return kind
    return ""


def pause_kind(state: ActionState) -> str:
    """Return "startPause" or "stopPause" if m2pem has sent that action, else "". Vehicles need not
    report the type of an action, so that its id has it."""
    parts = state.action_id.split("-")
    return parts[1] if state.action_id.startswith(ID_PREFIX) and len(parts) > 2 else ""


def traversed(state: State) -> int:
    """Return the number of the last node that the vehicle has reached."""
    return max(0, state.last_node_sequence_id) // 2


def base_end(state: State) -> int:
    """Return the number of the last released node."""
    released = [each.sequence_id for each in state.node_states if each.released]
    return max([state.last_node_sequence_id, *released]) // 2


def said_about(state: State, ids: Collection[str]) -> list[str]:
    """Return the errors that refer to an order or an action by its id, as text."""
    return [
        describe(error)
        for error in state.errors
        if error.error_references is not UNSET
        and any(each.reference_value in ids for each in error.error_references)
    ]


def said_of_instant_actions(state: State) -> list[str]:
    """Return the errors about the topic of instant actions, or those sent by m2pem, as text."""
    return [
        describe(error)
        for error in state.errors
        if error.error_references is not UNSET
        and any(
            each.reference_value == "instantActions" or each.reference_value.startswith(ID_PREFIX)
            for each in error.error_references
        )
    ]


def fatal_errors(state: State) -> str:
    """Return the errors with which a vehicle is not in running condition, as text; "": none."""
    return "; ".join(describe(each) for each in state.errors if each.error_level == "FATAL")


def not_ready_reasons(state: State, map_id: str, paused_by_us: bool) -> tuple[str, ...]:
    """Return why the vehicle would not do what it is asked; nothing if it is ready."""
    reasons = []
    if state.operating_mode != "AUTOMATIC":
        reasons.append(f"its operating mode is {text_of(state.operating_mode, 30)}")
    if state.safety_state.e_stop != "NONE":
        reasons.append(f"its emergency stop is active ({text_of(state.safety_state.e_stop, 30)})")
    reasons += [describe(error) for error in state.errors if error.error_level != "WARNING"]
    if (lost := wrong_position(state, map_id)) != "":
        reasons.append(lost)
    if is_paused(state) and not paused_by_us:
        reasons.append("it is paused, and not by m2pem")
    return tuple(reasons)


def wrong_position(state: State, map_id: str) -> str:
    """Return why the place of the vehicle is not known; "" if it is."""
    position = state.agv_position
    if position is UNSET:
        return "it reports no position"
    if not position.position_initialized:
        return "its position is not initialized"
    if position.map_id != map_id:
        return f"it is on the map {text_of(position.map_id, 60)!r}, not on {map_id!r}"
    return ""
