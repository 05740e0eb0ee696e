"""Conformance: what m2pem and other engines do with the very same BPMN files."""
