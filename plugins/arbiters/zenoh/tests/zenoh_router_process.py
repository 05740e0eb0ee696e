"""A Zenoh router: python zenoh_router_process.py ENDPOINT... It lives until its input is closed."""

import json
import sys

import zenoh

if __name__ == "__main__":
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    config.insert_json5("listen/endpoints", json.dumps(sys.argv[1:]))
    with zenoh.open(config):
        print("ready", flush=True)
        sys.stdin.read()
