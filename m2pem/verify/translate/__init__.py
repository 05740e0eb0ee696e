"""From a mission, and the fleet that it commands, to the rules that the checker searches."""

from m2pem.verify.net.size_limit import Bound, TooLargeError
from m2pem.verify.translate.mission import translate
from m2pem.verify.translate.options import Options

__all__ = ["Bound", "Options", "TooLargeError", "translate"]
