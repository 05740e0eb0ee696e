// Where in a formula something is wrong: the server sends the column, counted from 1.
export interface Pointed {
  line: string;
  /** From 0, in that line. */
  column: number;
}

const AT = /at column (\d+)(?: of line (\d+) of the formula)?(?:$|\s)/;

/** The line of a formula with the character that a message means; undefined: it has none. */
export function pointedAt(message: string, formula: string): Pointed | undefined {
  const match = AT.exec(message);
  if (!match) return undefined;
  const line = formula.split("\n")[Number(match[2] ?? "1") - 1];
  const column = Number(match[1]) - 1;
  if (line === undefined || column > line.length) return undefined;
  return { line, column };
}

const PLAIN = /^\s*(?:-\s+)?[\w-]+:\s*(.*)$/;
const QUOTED = /^"((?:[^"\\]|\\.)*)"|^'((?:[^']|'')*)'/;

/** The text of a key in a line of YAML, where it is in that line as a whole. */
export function scalarIn(line: string, key: string): string | undefined {
  const at = new RegExp(`(?:^|[{,\\s-])${key}:\\s*`).exec(line);
  if (!at) return undefined;
  const rest = line.slice(at.index + at[0].length);
  const quoted = QUOTED.exec(rest);
  if (quoted) return quoted[1]?.replace(/\\(.)/g, "$1") ?? quoted[2]?.replaceAll("''", "'");
  return PLAIN.exec(line) ? rest.replace(/\s+#.*$/, "").trim() : undefined;
}
