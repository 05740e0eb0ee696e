"""Draws BPMN files: a diagram for a model that has none, so that it opens in an editor."""
