"""What verification costs, beside other checkers of BPMN: `python -m bench --only verification`.

`works` says what is measured and what it must reach, `measuring` does it, `page` and `drawing` show
it. `bench/programs/verifying.py` and `bench/peers/` have the work itself, each in its own process.
"""
