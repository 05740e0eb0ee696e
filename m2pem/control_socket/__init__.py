"""A running executive, steered by other processes of its user: `m2pem answer`, `stop`, `attach`.

JSON-RPC 2.0, one message a line, over a Unix socket beside the journal (docs/operating.md).
"""
