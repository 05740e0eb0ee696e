"""The model checker Spin as an engine: the net as PROMELA, and Spin's answers in the mission's
words.
"""
