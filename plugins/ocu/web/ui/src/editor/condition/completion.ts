// What may come next in a condition or a script: names of data, values, operators, functions.
import type { Outline } from "../../shared/types";
import type { Dialect, DialectName } from "./dialect";

export interface Decided {
  /** The name that gets the decision. */
  store: string;
  values: { value: string; label: string }[];
}

export interface Completion {
  value: string;
  note?: string;
  /** What is said of it once it is chosen. */
  doc?: string;
  group: Group;
}

export type Group = "names" | "values" | "words" | "operators" | "functions";

export interface Completions {
  /** What is replaced: from here to the cursor. */
  from: number;
  options: Completion[];
}

const WORD = /[\p{L}_][\p{L}\p{N}_.-]*$/u;
const COMPARED = /([\p{L}_][\p{L}\p{N}_.-]*)\s*(==|!=|=)\s*(['"]?)([^'"]*)$/u;
const AFTER_OPERAND = /(?:[\p{L}\p{N}_)\]]|['"])\s+$/u;
const AFTER_OPERATOR_WORD = /\b(?:and|or|not|in)\s+$/;
const ENDED = /['")\]\p{N}]$/u;
const PHRASE = /\p{L}[\p{L}\p{N}_-]*(?:\s+[\p{L}\p{N}_-]+)*\s*$/u;

export function complete(
  text: string,
  cursor: number,
  names: Outline["names"],
  decided: readonly Decided[],
  name: DialectName,
  dialect: Dialect,
): Completions {
  const before = text.slice(0, cursor);
  return (
    afterComparison(before, decided, name === "feel" ? '"' : "'") ??
    insideText(before) ??
    phrase(before, dialect) ??
    afterOperand(before, dialect) ??
    word(before, names, name, dialect)
  );
}

/** After `user.decision ==`: what the prompts that write it may give. */
function afterComparison(
  before: string,
  decided: readonly Decided[],
  plainMark: string,
): Completions | undefined {
  const match = COMPARED.exec(before);
  if (!match) return undefined;
  const [, name = "", , quote = "", said = ""] = match;
  if (!quote && /\s\S*\s/.test(said)) return undefined;
  const values = new Map<string, string>();
  for (const { store, values: given } of decided) {
    if (store === name) for (const { value, label } of given) values.set(value, label);
  }
  if (values.size === 0) return undefined;
  const mark = quote || plainMark;
  const options = [...values]
    .filter(([value]) => value.startsWith(said.trim()))
    .map(([value, label]) => ({
      value: `${mark}${value}${mark}`,
      note: label === value ? "" : label,
      group: "values" as const,
    }));
  return { from: before.length - said.trimStart().length - quote.length, options };
}

/** Nothing is offered inside a text. */
function insideText(before: string): Completions | undefined {
  const quotes = before.match(/(?<!\\)['"]/g) ?? [];
  return quotes.length % 2 === 1 ? { from: before.length, options: [] } : undefined;
}

/** The rest of a function's name that has several words, as FEEL's have. */
function phrase(before: string, dialect: Dialect): Completions | undefined {
  let said = PHRASE.exec(before)?.[0] ?? "";
  while (/\s/.test(said)) {
    const begun = said.replace(/\s+/g, " ");
    const options = functionsOf(dialect, (name) => name.startsWith(begun));
    if (options.length > 0) return { from: before.length - said.length, options };
    said = said.replace(/^\S+\s+/, "");
  }
  return undefined;
}

function afterOperand(before: string, { operators }: Dialect): Completions | undefined {
  if (!AFTER_OPERAND.test(before) || AFTER_OPERATOR_WORD.test(before)) return undefined;
  const options = operators.map((value) => ({ value: `${value} `, group: "operators" as const }));
  return { from: before.length, options };
}

function functionsOf(dialect: Dialect, fits: (name: string) => boolean): Completion[] {
  const found = dialect.functions.filter(({ name }) => fits(name));
  return found.map(({ name, signatures, doc }) => ({
    value: `${name}(`,
    note: signatures[0]?.slice(name.length) ?? "",
    doc,
    group: "functions" as const,
  }));
}

function word(
  before: string,
  names: Outline["names"],
  dialectName: DialectName,
  dialect: Dialect,
): Completions {
  const typed = WORD.exec(before)?.[0] ?? "";
  if (typed === "" && ENDED.test(before)) return { from: before.length, options: [] };
  const fits = (value: string) => value.toLowerCase().includes(typed.toLowerCase());
  const starts = (value: string) => typed !== "" && value.startsWith(typed);
  const known = names
    .filter(({ name }) => fits(name))
    .map(({ name, from }) => ({
      value: dialectName === "xpath" ? `getDataObject('${name}')` : name,
      note: from,
      group: "names" as const,
    }));
  const words = dialect.words.filter(starts).map((value) => ({ value, group: "words" as const }));
  const options = [...known, ...words, ...functionsOf(dialect, starts)];
  const isWhole = options.length === 1 && options[0]?.value === typed;
  return { from: before.length - typed.length, options: isWhole ? [] : options };
}
