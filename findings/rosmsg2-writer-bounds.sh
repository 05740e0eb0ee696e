#!/usr/bin/env bash
# Program: @foxglove/rosmsg2-serialization 3.1.0. Date: 2026-11-29.
# Expected: a message of ROS 2 is written as its definition says, or refused: `uint8[<=3]` has at most three items and
#   `string<=2` two characters (ROS 2, "About interfaces"), a uint8 is 0 to 255; the length of a text counts its bytes
#   (CDR, OMG DDSI-RTPS 9.3.1). An array of a fixed length is refused if it has another one.
# Seen: bounds are read by the parser and not looked at by the writer, 300 becomes 44, 1.9 becomes 1. A text with
#   letters beyond ASCII is cut by as many bytes as these need more: "25 °C" is sent as "25 °", with the unit gone.
# Matters: a reader in C++ or Python refuses the message, or acts on another number than was sent.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-fund --no-audit @foxglove/rosmsg2-serialization@3.1.0 @foxglove/rosmsg@5.0.5 @foxglove/cdr@3.5.0 >/dev/null

cat > try.mjs <<'EOF'
import { parse } from '@foxglove/rosmsg'
import { MessageReader, MessageWriter } from '@foxglove/rosmsg2-serialization'
const read = (definition, message) => {
  const types = parse(definition, { ros2: true })
  try {
    const { a } = new MessageReader(types).readMessage(new MessageWriter(types).writeMessage({ a: message }))
    return ArrayBuffer.isView(a) ? [...a] : a
  } catch (error) {
    return error.message
  }
}
for (const [definition, message] of [
  ['uint8[3] a', [1, 2, 3, 4]], ['uint8[<=3] a', [1, 2, 3, 4]], ['string<=2 a', 'abcdef'],
  ['uint8 a', 300], ['int32 a', 1.9], ['string a', '25 °C'],
]) console.log(definition, JSON.stringify(message), '->', JSON.stringify(read(definition, message)))
EOF
diff <(node try.mjs) - <<'EOF'
uint8[3] a [1,2,3,4] -> "Expected 3 items for fixed-length array field a but received 4"
uint8[<=3] a [1,2,3,4] -> [1,2,3,4]
string<=2 a "abcdef" -> "abcdef"
uint8 a 300 -> 44
int32 a 1.9 -> 1
string a "25 °C" -> "25 °"
EOF
echo "as seen: bounds and ranges are not looked at, and a text loses its last letters"
