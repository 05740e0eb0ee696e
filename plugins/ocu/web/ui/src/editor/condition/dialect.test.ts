import { describe, expect, it } from "vitest";
import { dialectOf, stoppedAt, tokensOf, type Dialect } from "./dialect";

const dialect: Dialect = {
  functions: ["string", "string length", "starts-with"].map((name) => ({ name, signatures: [], doc: "" })),
  words: ["and", "true"],
  operators: [],
};
const kinds = (text: string) =>
  tokensOf(text, dialect).map(({ kind, from, to }) => [kind, text.slice(from, to)]);

describe("the dialect of a text", () => {
  it("is that of its marks", () => {
    expect(dialectOf(" = a")).toBe("feel");
    expect(dialectOf("${a}")).toBe("juel");
    expect(dialectOf("#{a}", "FEEL")).toBe("juel");
    expect(dialectOf("bpmn:getDataObject('a') = 1")).toBe("xpath");
    expect(dialectOf("a == 1")).toBe("m2pem");
  });

  it("is otherwise that of its language", () => {
    expect(dialectOf("a", "https://www.omg.org/spec/DMN/20191111/FEEL/")).toBe("feel");
    expect(dialectOf("a", "http://www.w3.org/1999/XPath")).toBe("xpath");
    expect(dialectOf("a", "juel")).toBe("juel");
    expect(dialectOf("= a", "m2pem")).toBe("m2pem");
  });
});

describe("what an expression consists of", () => {
  it("is names, words, numbers and texts", () => {
    expect(kinds("mission.lap >= 2.5 and true")).toEqual([
      ["name", "mission.lap"],
      ["number", "2.5"],
      ["word", "and"],
      ["word", "true"],
    ]);
    expect(kinds("'and \\' 1' \"open")).toEqual([
      ["text", "'and \\' 1'"],
      ["text", '"open'],
    ]);
  });

  it("is functions where they are called, the longest names first", () => {
    expect(kinds("string length (a) + string(b) + string")).toEqual([
      ["function", "string length"],
      ["name", "a"],
      ["function", "string"],
      ["name", "b"],
      ["name", "string"],
    ]);
    expect(kinds("starts-with(x) // string(x)")).toEqual([
      ["function", "starts-with"],
      ["name", "x"],
      ["comment", "// string(x)"],
    ]);
  });
});

describe("where the server's parser stopped", () => {
  it("is the column of what it quotes", () => {
    expect(stoppedAt("not an expression: expected a value at column 5 of 'a = ='", "a = =")).toBe(4);
    expect(stoppedAt('expected a value at column 3 of "a \'"', "x = 1\na '")).toBe(8);
    expect(stoppedAt("it ends at column 7 of '= a\\n+'", "= a\n+")).toBe(5);
  });

  it("is nowhere in another text", () => {
    expect(stoppedAt("expected a value at column 5 of 'a = ='", "b")).toBeUndefined();
    expect(stoppedAt("there is no vehicle evsg9", "a")).toBeUndefined();
  });
});
