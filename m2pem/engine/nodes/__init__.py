"""One handler for each kind of BPMN element."""
