// The editor's descriptor has just the names of m2pem's vocabulary, from which vocabulary.json is
// made (`python -m m2pem.bpmn.pages editor`).
import { describe, expect, it } from "vitest";
import { m2pemDescriptor } from "./descriptor";
import vocabulary from "./vocabulary.json";

interface Property {
  name: string;
  type: string;
  isAttr?: boolean;
  isBody?: boolean;
}
interface Type {
  name: string;
  extends?: string[];
  properties: Property[];
}

const types = new Map((m2pemDescriptor.types as Type[]).map((type) => [type.name, type]));
const typeOf = (element: string) => element.charAt(0).toUpperCase() + element.slice(1);

function attributes(type: Type | undefined): string[] {
  return (type?.properties ?? []).filter((each) => each.isAttr).map((each) => each.name).sort();
}

describe("the descriptor is m2pem's vocabulary", () => {
  it("has its namespace", () => expect(m2pemDescriptor.uri).toBe(vocabulary.uri));

  it("has its types, and no others", () => {
    const known = [...Object.keys(vocabulary.elements).map(typeOf)];
    expect([...types.keys()].sort()).toEqual(
      [...known, ...Object.keys(vocabulary.extensions)].sort(),
    );
  });

  for (const [name, element] of Object.entries(vocabulary.elements)) {
    it(`knows m2pem:${name}`, () => {
      const type = types.get(typeOf(name));
      expect(attributes(type)).toEqual(element.attributes);
      const body = type?.properties.some((each) => each.isBody) ?? false;
      expect(body).toBe(element.text);
      const inside = (type?.properties ?? [])
        .filter((each) => !each.isAttr && !each.isBody && each.type !== "Element")
        .map((each) => each.type);
      expect([...new Set(inside)].sort()).toEqual(element.children.map(typeOf).sort());
    });
  }

  for (const [name, extension] of Object.entries(vocabulary.extensions)) {
    it(`knows the attributes of ${extension.places.join(", ")}`, () => {
      const type = types.get(name);
      expect(attributes(type)).toEqual(extension.attributes);
      const places = extension.places.map((place) => `bpmn:${typeOf(place)}`).sort();
      expect([...(type?.extends ?? [])].sort()).toEqual(places);
    });
  }
});
