"""Choosing vehicles and payloads for the roles of tasks when they start (docs/allocation.md).

`candidates` knows the facts of each vehicle and payload, `needs` says which of them may fill a role
and what each costs, `assignment` chooses for all tasks together, `explanation` says why. All
are pure: the executive asks them (`m2pem.executive.allocator`) and makes inputs of the answers.
"""
