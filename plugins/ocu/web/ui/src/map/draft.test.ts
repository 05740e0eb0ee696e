import { describe, expect, it } from "vitest";
import {
  added,
  draftOf,
  emptyDraft,
  featureOf,
  geometryOf,
  inFrame,
  moved,
  problemOf,
  removed,
  undone,
} from "./draft";

const at = (latitude: number, longitude: number, altitude: number | null = null) => ({
  latitude,
  longitude,
  altitude,
});

const route = () => added(added({ ...emptyDraft("route"), name: "r" }, at(1, 2)), at(3, 4, 50));

describe("draft", () => {
  it("becomes GeoJSON: longitude first, areas closed", () => {
    expect(geometryOf(route())).toEqual({
      type: "LineString",
      coordinates: [
        [2, 1],
        [4, 3, 50],
      ],
    });
    const area = added({ ...route(), kind: "area" }, at(5, 6));
    expect(geometryOf(area)).toEqual({
      type: "Polygon",
      coordinates: [
        [
          [2, 1],
          [4, 3, 50],
          [6, 5],
          [2, 1],
        ],
      ],
    });
  });

  it("is made of a geometry again", () => {
    const geometry = geometryOf(added({ ...route(), kind: "area" }, at(5, 6)));
    const known = {
      name: "a",
      kind: "area",
      geometry,
      altitude_frame: "amsl",
      from: "fleet",
      by: "",
      at_us: null,
    } as const;
    expect(featureOf(draftOf(known))).toEqual({
      type: "Feature",
      properties: { altitude_frame: "amsl" },
      geometry,
    });
  });

  it("keeps the holes of an area", () => {
    const ring = [
      [0, 0],
      [9, 0],
      [9, 9],
      [0, 0],
    ];
    const geometry = { type: "Polygon" as const, coordinates: [ring, ring] };
    const known = {
      name: "a",
      kind: "area",
      geometry,
      altitude_frame: "relative",
      from: "fleet",
      by: "",
      at_us: null,
    } as const;
    expect(geometryOf(draftOf(known))).toEqual(geometry);
  });

  it("takes changes back, one by one", () => {
    const draft = removed(moved(route(), 0, { latitude: 9 }), 1);
    expect(draft.vertices).toEqual([at(9, 2)]);
    expect(undone(draft).vertices).toEqual([at(9, 2), at(3, 4, 50)]);
    expect(undone(undone(undone(undone(undone(draft))))).vertices).toEqual([]);
  });

  it("has one vertex as a point", () => {
    const point = added(added(emptyDraft("point"), at(1, 2)), at(3, 4));
    expect(point.vertices).toEqual([at(3, 4)]);
  });

  it("says what it lacks", () => {
    expect(problemOf(emptyDraft("route"))).toBe("vertices");
    expect(problemOf({ ...route(), kind: "area" })).toBe("vertices");
    expect(problemOf({ ...route(), name: "" })).toBe("name");
    expect(problemOf({ ...route(), name: "../x" })).toBe("name");
    expect(problemOf(route())).toBeNull();
  });
});

it("the speeds of a route's waypoints go along with them", () => {
  const lane = draftOf({
    name: "lane",
    kind: "route",
    geometry: {
      type: "LineString",
      coordinates: [
        [10, 50],
        [10.1, 50],
        [10.2, 50],
      ],
    },
    altitude_frame: "relative",
    speeds_m_s: [null, 2.5, 8],
    from: "mission",
    by: "",
    at_us: null,
  });
  expect(featureOf(lane).properties).toEqual({
    altitude_frame: "relative",
    speeds_m_s: [null, 2.5, 8],
  });
  const changed = moved(removed(lane, 0), 0, { latitude: 51 });
  expect(featureOf(changed).properties?.speeds_m_s).toEqual([2.5, 8]);
  expect(featureOf(removed(removed(lane, 1), 1)).properties).toEqual({
    altitude_frame: "relative",
  });
});

it("keeps the altitude frame of each waypoint of a route", () => {
  const lane = draftOf({
    name: "lane",
    kind: "route",
    geometry: {
      type: "LineString",
      coordinates: [
        [10, 50, 20],
        [10.1, 50, 95],
        [10.2, 50, 30],
      ],
    },
    altitude_frame: "relative",
    altitude_frames: ["relative", "amsl", "relative"],
    from: "mission",
    by: "",
    at_us: null,
  });
  const properties = {
    altitude_frame: "relative",
    altitude_frames: ["relative", "amsl", "relative"],
  };
  expect(featureOf(lane).properties).toEqual(properties);
  const reversed = { ...lane, vertices: lane.vertices.slice(1) };
  expect(featureOf(reversed).properties).toEqual({
    altitude_frame: "amsl",
    altitude_frames: ["amsl", "relative"],
  });
  expect(featureOf(removed(lane, 1)).properties).toEqual({ altitude_frame: "relative" });
  expect(featureOf(inFrame(lane, "terrain")).properties).toEqual({ altitude_frame: "terrain" });
});
