// Missions on the server: opened, saved with the version that they were drawn from, and kept.
import { ApiError, get, post, put } from "../shared/api";
import type { MissionFile } from "../shared/types";

export interface SavedVersion {
  version: string;
  by: string;
  saved_at_us: number;
}

export interface Version extends SavedVersion {
  number: number;
}

/** `current`: what another user saved meanwhile; null: it was removed. */
export type Outcome =
  { kind: "saved"; saved: SavedVersion } | { kind: "conflict"; current: SavedVersion | null };

const path = (mission: string) => `/missions/${encodeURIComponent(mission)}`;

export const openMission = (mission: string) => get<MissionFile>(path(mission));
export const versionsOf = (mission: string) => get<Version[]>(`${path(mission)}/versions`);
export const openVersion = (mission: string, number: number) =>
  get<MissionFile>(`${path(mission)}/versions/${number}`);

/** A file as the editor can take it. `layout`: with everything in a new place. */
export const makeEditable = (xml: string, layout = false) =>
  post<{ xml: string; notes: string[] }>("/editable", { xml, layout });

/** `base`: the version that it was drawn from; null: there must be none of that name. */
export async function saveMission(
  mission: string,
  xml: string,
  base: string | null,
): Promise<Outcome> {
  try {
    return { kind: "saved", saved: await put<SavedVersion>(path(mission), { xml, base }) };
  } catch (error) {
    if (error instanceof ApiError && error.status === 409) {
      const current = error.problem.current as SavedVersion | null | undefined;
      if (current !== undefined) return { kind: "conflict", current };
    }
    throw error;
  }
}

const NAME = /^[\p{L}\p{N}_-][\p{L}\p{N}_. -]{0,99}$/u;
const BAD_END = /[ .]$|\.bpmn$/i;

export function isName(name: string): boolean {
  return NAME.test(name) && !BAD_END.test(name);
}

/** "My mission.bpmn" of somebody's disk as the name of a mission. */
export function nameOfFile(file: string): string {
  const stem = file.replace(/(\.bpmn20)?\.(bpmn2?|xml)$/i, "");
  const clean = stem.replace(/[^\p{L}\p{N} ._-]/gu, "_").replace(/^[^\p{L}\p{N}]+/u, "");
  return clean.slice(0, 100).replace(/[ .]+$/, "") || "mission";
}

export function freeName(name: string, taken: readonly string[]): string {
  for (let number = 2, free = name; ; number += 1) {
    if (!taken.includes(free)) return free;
    free = `${name} ${number}`;
  }
}

/** A start event, in a process that can be started. */
export function emptyMission(name: string): string {
  const id = `Process_${name.replace(/[^A-Za-z0-9]+/g, "_")}`;
  const title = name.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");
  return `<?xml version="1.0" encoding="UTF-8"?>
<bpmn:definitions xmlns:bpmn="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:bpmndi="http://www.omg.org/spec/BPMN/20100524/DI" xmlns:dc="http://www.omg.org/spec/DD/20100524/DC" xmlns:di="http://www.omg.org/spec/DD/20100524/DI" xmlns:m2pem="https://m2pem.org/schema/1" id="Definitions_1" targetNamespace="https://m2pem.org/missions">
  <bpmn:process id="${id}" name="${title}" isExecutable="true">
    <bpmn:startEvent id="Start" />
  </bpmn:process>
  <bpmndi:BPMNDiagram id="Diagram_1">
    <bpmndi:BPMNPlane id="Plane_1" bpmnElement="${id}">
      <bpmndi:BPMNShape id="Start_di" bpmnElement="Start">
        <dc:Bounds x="180" y="180" width="36" height="36" />
      </bpmndi:BPMNShape>
    </bpmndi:BPMNPlane>
  </bpmndi:BPMNDiagram>
</bpmn:definitions>
`;
}
