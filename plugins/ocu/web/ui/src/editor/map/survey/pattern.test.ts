import { expect, test } from "vitest";
import { patternOf, readPattern, renamedIn, requestOf, spacedBy, writePattern } from "./pattern";

const FIELD: GeoJSON.Polygon = { type: "Polygon", coordinates: [] };

test("what is written is read back, and what is no pattern is none", () => {
  const pattern = { ...spacedBy(patternOf("field"), "camera"), keep_out: ["farm"] };
  expect(readPattern(writePattern(pattern))).toEqual(pattern);
  for (const text of ["", "null", "[]", '{"area": "field"}', '{"spacing_m": 5}', "{"])
    expect(readPattern(text)).toBeNull();
});

test("areas are known by their new names, in all places", () => {
  const pattern = { ...patternOf("field"), keep_out: ["farm", "pond"] };
  const renamed = readPattern(renamedIn(writePattern(pattern), "farm", "barn")!);
  expect(renamed).toEqual({ ...pattern, keep_out: ["barn", "pond"] });
  expect(renamedIn(writePattern(pattern), "other", "barn")).toBeNull();
});

test("a request has the areas themselves, or says which there is not", () => {
  const pattern = { ...patternOf("field"), keep_out: ["farm"] };
  const find = (name: string) => (name === "farm" ? undefined : FIELD);
  expect(requestOf(pattern, find)).toBe("farm");
  expect(requestOf(pattern, () => FIELD)).toMatchObject({ area: FIELD, keep_out: [FIELD] });
});

test("a camera needs a height above home or the ground", () => {
  const level = { ...patternOf("field"), altitude_m: null, altitude_frame: "amsl" as const };
  const pictured = spacedBy(level, "camera");
  expect(pictured.spacing_m).toBeUndefined();
  expect(pictured.altitude_m).toBeGreaterThan(0);
  expect(pictured.altitude_frame).toBe("relative");
  expect(spacedBy(pictured, "spacing").camera).toBeUndefined();
});
