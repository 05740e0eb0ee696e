"""Run-time monitors: the requirements of a mission, evaluated over the records of its run."""
