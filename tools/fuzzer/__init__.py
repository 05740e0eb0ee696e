"""Strange BPMN files, made of good ones: m2pem refuses each with findings, or runs it."""
