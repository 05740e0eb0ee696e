"""What all tests here go by: none fails because a computer is busy with something else."""

import os
import signal
import tempfile

from hypothesis import HealthCheck, settings

# What a change has broken fails, and fails again: `make test` tries the same examples every time.
# The long tests try others (`--hypothesis-profile random`).
settings.register_profile(
    "random", deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
settings.register_profile("repeatable", settings.get_profile("random"), derandomize=True)
settings.load_profile("repeatable")

# A shell that starts the tests in the background has them, and all that they start, ignore Ctrl-C.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Executives that tests start are no concern of those that this user runs, nor of another worker's.
os.environ["M2PEM_RUNTIME_DIR"] = tempfile.mkdtemp(prefix="m2pem-tests-")
