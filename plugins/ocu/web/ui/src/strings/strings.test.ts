import ts from "typescript";
import { describe, expect, test } from "vitest";
import { german } from "./de";
import { english } from "./english";
import { languageOf } from "./language";
import { translated } from "./texts";

/** Every text by its path: "shell.roles.viewer". */
function flat(texts: unknown, path = ""): [string, string][] {
  if (typeof texts !== "object" || texts === null) return [[path, String(texts)]];
  return Object.entries(texts).flatMap(([key, text]) => flat(text, path ? `${path}.${key}` : key));
}

const placeholders = (text: string) => [...text.matchAll(/\{\w+\}/g)].map(String).sort();

describe("the German texts", () => {
  const wanted = new Map(flat(english));
  const found = new Map(flat(german));

  test("have every key of the English ones", () => {
    const missing = [...wanted].filter(([key]) => !found.has(key));
    expect(missing.map(([key, text]) => `${key}: ${text}`)).toEqual([]);
  });

  test("have no other key", () => {
    expect([...found.keys()].filter((key) => !wanted.has(key))).toEqual([]);
  });

  test("have the placeholders of the English ones", () => {
    const wrong = [...found].filter(
      ([key, text]) => String(placeholders(text)) !== String(placeholders(wanted.get(key) ?? "")),
    );
    expect(wrong.map(([key, text]) => `${key}: ${text}`)).toEqual([]);
  });

  test("are empty only where the English ones are", () => {
    const wrong = [...found].filter(([key, text]) => (text === "") !== (wanted.get(key) === ""));
    expect(wrong.map(([key]) => key)).toEqual([]);
  });
});

test("what a translation lacks stays English", () => {
  const texts = { a: "one", b: { c: "two", d: "three" }, e: [{ f: "four", g: "five" }] } as const;
  expect(translated(texts, { b: { c: "zwei" }, e: [{ f: "vier" }] })).toEqual({
    a: "one",
    b: { c: "zwei", d: "three" },
    e: [{ f: "vier", g: "five" }],
  });
});

test("the chosen language is used, else the best of the browser's that there is", () => {
  expect(languageOf("de", ["en-US"])).toBe("de");
  expect(languageOf(null, ["fr-FR", "de-AT", "en"])).toBe("de");
  expect(languageOf(null, ["fr-FR"])).toBe("en");
  expect(languageOf("klingon", ["en-GB", "de"])).toBe("en");
  expect(languageOf("toString", [])).toBe("en");
});

const COMPONENTS = import.meta.glob<string>("../**/*.tsx", {
  query: "?raw",
  import: "default",
  eager: true,
});
const READ_ALOUD = new Set(["title", "aria-label", "placeholder", "alt", "label", "aria-description"]);
/** Of every language: units, keys, names of things. */
const NO_TEXT = /^[^\p{L}]*$|^[^\p{L}]*(m|m\/s|s|ms|kB|MB|px|Hz|YAML|LTL|BPMN|STOP)[^\p{L}]*$/u;
/** Examples of what is entered in a language of programs: "speed = 3". */
const EXPRESSION = /[=<>*]|\w_\w/;

/** Texts between tags, and of attributes that are read. */
function textsIn(file: string, content: string): string[] {
  const source = ts.createSourceFile(file, content, ts.ScriptTarget.Latest, true);
  const found: string[] = [];
  const keep = (text: string, node: ts.Node) => {
    const { line } = source.getLineAndCharacterOfPosition(node.getStart());
    if (!NO_TEXT.test(text.trim())) {
      found.push(`${file}:${line + 1}: ${text.trim()}`);
    }
  };
  const look = (node: ts.Node): void => {
    if (ts.isJsxText(node)) keep(node.text, node);
    const isRead = ts.isJsxAttribute(node) && READ_ALOUD.has(node.name.getText());
    if (isRead && node.initializer && ts.isStringLiteral(node.initializer)) {
      const { text } = node.initializer;
      if (!(node.name.getText() === "placeholder" && EXPRESSION.test(text))) keep(text, node);
    }
    const parent = node.parent as ts.Node | undefined;
    if (ts.isStringLiteralLike(node) && parent && ts.isJsxExpression(parent)) {
      if (ts.isJsxElement(parent.parent) || ts.isJsxFragment(parent.parent)) keep(node.text, node);
    }
    ts.forEachChild(node, look);
  };
  look(source);
  return found;
}

test("no text is written into a component", { timeout: 60_000 }, () => {
  const components = Object.entries(COMPONENTS);
  expect(components.length).toBeGreaterThan(50);
  expect(components.flatMap(([file, content]) => textsIn(file, content))).toEqual([]);
});
