"""What BPMN 2.0.2 and m2pem forbid in a mission file: each finding's number, clause and sentences.

A module has the rules of one family of elements. The readers of `m2pem.bpmn` check them while they
read, or the module's own checks do so on the XML tree. `registry` has all rules and runs the
checks. docs/rules.md is made from them.
"""
