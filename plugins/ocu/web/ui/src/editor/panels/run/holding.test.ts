import { expect, test } from "vitest";
import { standing } from "./holding";

test("a vehicle is with a run and its task, with an operator, or only named", () => {
  const holders = { uav1: "r1.b3", uav2: "anna", uav3: "" };
  const labels = { "r1.b3": "Survey of r1" };
  const found = standing({ uav1: "r1", uav2: "anna", uav3: "r2" }, holders, labels, []);
  expect(found.map(({ run, who, task, free }) => [run, who, task, free])).toEqual([
    ["r1", "r1", "Survey of r1", false],
    ["", "anna", "", false],
    ["r2", "r2", "", false],
  ]);
});

test("nothing is free before it is known who has what", () => {
  expect(standing({ uav1: "anna" }, null, {}, [])[0]).toMatchObject({ free: false });
});

test("the vehicles of a run that was stopped are free when nothing has them", () => {
  const refused = { uav1: "r1", uav2: "anna" };
  const still = standing(refused, { uav1: "r1.b3", uav2: "" }, {}, ["r1"]);
  expect(still.map(({ free }) => free)).toEqual([false, true]);
  const gone = standing(refused, { uav1: "", uav2: "" }, {}, ["r1"]);
  expect(gone.map(({ free }) => free)).toEqual([true, true]);
});
