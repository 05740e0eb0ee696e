"""How much memory an object holds, whatever its attributes are called."""

import gc
import sys
from types import FunctionType, MethodType, ModuleType

SHARED = (type, ModuleType, FunctionType, MethodType)


def held_bytes(root: object) -> int:
    """The size of an object and of all that only it leads to, without classes and functions."""
    seen: dict[int, object] = {}
    left = [root]
    while left:
        each = left.pop()
        if id(each) in seen or isinstance(each, SHARED):
            continue
        seen[id(each)] = each
        left += gc.get_referents(each)
    return sum(map(sys.getsizeof, seen.values()))
