"""What all tests here go by: none fails because a computer is busy with something else."""

from hypothesis import HealthCheck, settings

# Beside what is said here, what Hypothesis itself takes to be right where it is run.
settings.register_profile(
    "patient", settings(), deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("patient")
