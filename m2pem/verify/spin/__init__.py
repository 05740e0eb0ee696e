"""The model checker Spin as an engine: rules as PROMELA, Spin's answers in the mission's words."""
