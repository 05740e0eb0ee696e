#!/usr/bin/env bash
# Program: eclipse-zenoh 1.10.2 (Python). Date: 2026-11-29.
# Expected: two vehicles declare a queryable on the same key expression, and a get() receives the reply of each, as a
#   discovery needs it.
# Seen: get() receives one reply. The default consolidation keeps the latest value of each *replied key*, and both reply
#   on the same key; without timestamps it is left open which. Only ConsolidationMode.NONE shows both. If both declare
#   complete=True, even that shows one: the default target then asks just one of them; QueryTarget.ALL asks both.
# Matters: a fleet view that polls "who" counts one vehicle; no reply is reported as lost.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile eclipse-zenoh==1.10.2

cat > try.py <<'EOF'
import json, socket, time, zenoh

with socket.socket() as probe:
    probe.bind(("127.0.0.1", 0))
    place = f"tcp/127.0.0.1:{probe.getsockname()[1]}"

def session(**endpoints):
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    for kind in ("listen", "connect"):
        config.insert_json5(f"{kind}/endpoints", json.dumps(endpoints.get(kind, [])))
    return zenoh.open(config)

asking = session(listen=[place])
for name in ("r1", "r2"):
    vehicle = session(connect=[place])
    for key, complete in (("who", False), ("all/who", True)):
        vehicle.declare_queryable(key, lambda query, name=name: query.reply(query.key_expr, name), complete=complete)
    globals()[name] = vehicle

def ask(key, **options):
    return sum(reply.ok is not None for reply in asking.get(key, timeout=5, **options))

NONE, ALL = zenoh.ConsolidationMode.NONE, zenoh.QueryTarget.ALL
for _ in range(50):  # until both declarations have arrived
    if ask("who", consolidation=NONE) == 2 and ask("all/who", consolidation=NONE, target=ALL) == 2:
        break
    time.sleep(0.1)
print("default", ask("who"), "no consolidation", ask("who", consolidation=NONE))
print("complete: no consolidation", ask("all/who", consolidation=NONE), "and all",
      ask("all/who", consolidation=NONE, target=ALL))
for each in (asking, r1, r2):
    each.close()
EOF
diff <(timeout 60 venv/bin/python try.py) - <<'EOF'
default 1 no consolidation 2
complete: no consolidation 1 and all 2
EOF
echo "as seen: two queryables on one key, one reply"
