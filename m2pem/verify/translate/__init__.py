"""From a mission, and the fleet that it commands, to the rules that the checker searches."""

from m2pem.verify.translate.bound import Bound, TooLargeError
from m2pem.verify.translate.derive import derive
from m2pem.verify.translate.options import Options

__all__ = ["Bound", "Options", "TooLargeError", "derive"]
