"""What `m2pem verify` says of models that others drew, file by file, within time and memory."""
