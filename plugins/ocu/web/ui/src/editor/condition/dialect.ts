// The dialects of expressions (docs/conditions.md): which one a text is in, and what it has.

export interface FunctionText {
  name: string;
  /** The ways to call it; what ends in ? may be left out. */
  signatures: string[];
  /** What it gives. */
  doc: string;
}

export interface Dialect {
  functions: FunctionText[];
  words: string[];
  operators: string[];
}

export type DialectName = "m2pem" | "juel" | "feel" | "xpath";
export type Dialects = Record<DialectName, Dialect>;

const XPATH = /\bget(?:DataInput|DataObject|DataOutput|ProcessProperty)\s*\(/;

/** As the server decides: by the marks of the text, else by the language that the file gives it. */
export function dialectOf(text: string, language = ""): DialectName {
  const given = language.toLowerCase();
  const said = text.trimStart();
  if (given === "m2pem") return "m2pem";
  if (/^[$#]\{/.test(said)) return "juel";
  if (said.startsWith("=")) return "feel";
  if (given.split(/[/:#]/).includes("feel")) return "feel";
  if (given.endsWith("juel")) return "juel";
  return given.includes("xpath") || XPATH.test(said) ? "xpath" : "m2pem";
}

export interface Token {
  kind: "text" | "number" | "word" | "function" | "name" | "comment";
  from: number;
  to: number;
}

const NAME = String.raw`[\p{L}_][\p{L}\p{N}_]*(?:[.-][\p{L}\p{N}_]+)*`;

/** What an expression consists of, without its operators. */
export function tokensOf(text: string, dialect: Dialect): Token[] {
  const called = dialect.functions.map(({ name }) => name.replaceAll(" ", String.raw`\s+`));
  const longestFirst = called.sort((a, b) => b.length - a.length).join("|");
  const pattern = new RegExp(
    [
      String.raw`(?<comment>\/\/.*|\/\*[^]*?\*\/)`,
      String.raw`(?<text>"(?:[^"\\]|\\.)*"?|'(?:[^'\\]|\\.)*'?)`,
      String.raw`(?<number>\d+(?:\.\d+)?)`,
      String.raw`(?<function>(?<![\p{L}\p{N}_.-])(?:${longestFirst})(?=\s*\())`,
      String.raw`(?<name>${NAME})`,
    ].join("|"),
    "gu",
  );
  return [...text.matchAll(pattern)].map((match) => {
    const [kind = "name"] = Object.entries(match.groups!).find(([, found]) => found) ?? [];
    const isWord = kind === "name" && dialect.words.includes(match[0]);
    const from = match.index;
    return { kind: (isWord ? "word" : kind) as Token["kind"], from, to: from + match[0].length };
  });
}

const AT = /at column (\d+) of (['"])(.*)\2$/;

/** Where in a text the server's parser stopped; undefined: its message names no place in it. */
export function stoppedAt(message: string, text: string): number | undefined {
  const [, column, , quoted] = AT.exec(message) ?? [];
  if (column === undefined || quoted === undefined) return undefined;
  const written = quoted.replace(/\\(.)/g, (_, sign: string) => (sign === "n" ? "\n" : sign));
  const start = text.indexOf(written);
  return start < 0 ? undefined : Math.min(start + Number(column) - 1, text.length);
}
