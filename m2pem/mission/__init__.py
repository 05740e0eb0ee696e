"""The mission: parsed from BPMN 2.0 XML, checked, never changed. Pure."""
