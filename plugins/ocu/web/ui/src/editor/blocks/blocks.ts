// The blocks that a mission is drawn with, made from what the fleet can do: each gives a task.
import type { Behavior, Parameter } from "../../shared/types";
import { fill, strings } from "../../strings";
import type { BehaviorUse, Role, ServiceUse } from "../moddle/behavior";
import type { Candidate, Catalogue, Domain } from "../session/catalogue";
import { shownDuration } from "../session/durations";
import { defaultOf } from "../session/quantities";
import type { Fragment } from "./control/fragment";
import { fragmentOf, KINDS, type FragmentKind, type Options } from "./control/fragments";
import { intentsOf } from "./control/intents";

export type BlockGroup = Domain | "control" | "payload" | "team" | "service" | "operator";

export const GROUPS: readonly BlockGroup[] = [
  "control",
  "operator",
  "ground",
  "air",
  "surface",
  "subsurface",
  "payload",
  "team",
  "service",
];

/** What a task does. */
export type TaskContent =
  | { kind: "behavior"; use: BehaviorUse }
  | { kind: "service"; use: ServiceUse }
  | { kind: "prompt" };

export type Content =
  | TaskContent
  | { kind: "fragment"; of: FragmentKind; options: Options; fragment: Fragment };

export interface Block {
  id: string;
  group: BlockGroup;
  title: string;
  doc: string;
  /** The word of the catalogue, for those who know it. */
  word: string;
  content: Content;
}

/** Pan, tilt and zoom. */
const ABBREVIATION = /^ptz\b/;

/** "single_vehicle_routing" for people: "Single vehicle routing". */
export function titleOf(name: string): string {
  const words = name.replaceAll("_", " ").trim().replace(ABBREVIATION, (each) => each.toUpperCase());
  return words.charAt(0).toUpperCase() + words.slice(1);
}

export function blocksOf(catalogue: Catalogue): Block[] {
  const blocks = [
    ...KINDS.map((kind) => controlBlock(catalogue, kind)),
    promptBlock(),
    ...catalogue.behaviors.flatMap((behavior, index) => behaviorBlocks(catalogue, behavior, index)),
    ...catalogue.services.map((service) => serviceBlock(catalogue, service.name)),
  ];
  const rank = (block: Block) => GROUPS.indexOf(block.group);
  return blocks.sort((a, b) => rank(a) - rank(b) || compare(a, b));
}

function compare(a: Block, b: Block): number {
  // Those for the course of a mission have an order of their own.
  return a.group === b.group && a.group !== "control" ? a.title.localeCompare(b.title) : 0;
}

/** Those that have every word of a search in their title, word or doc, after what it may mean. */
export function matching(
  catalogue: Catalogue,
  blocks: readonly Block[],
  search: string,
): Block[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const meant = intentsOf(search).map(({ kind, options }) => controlBlock(catalogue, kind, options));
  const kinds = new Set(meant.map(({ word }) => word));
  const others = blocks.filter((block) => {
    if (block.group === "control" && kinds.has(block.word)) return false;
    const group = strings.editor.blocks.groups[block.group];
    const text = `${block.title} ${block.word} ${block.doc} ${group}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
  return [...meant, ...others];
}

/** A block for the course of a mission; `options`: what a search says about it. */
export function controlBlock(
  catalogue: Catalogue,
  kind: FragmentKind,
  options: Options = {},
): Block {
  const { title, doc } = strings.control.blocks[wordingOf(kind, options)];
  const { duration = "", count = 0 } = options;
  return {
    id: `control-${kind}`,
    group: "control",
    title: fill(title, { duration: shownDuration(duration), count }),
    doc,
    word: kind,
    content: {
      kind: "fragment",
      of: kind,
      options,
      fragment: fragmentOf(kind, options, detectorContent(catalogue)),
    },
  };
}

function wordingOf(kind: FragmentKind, { duration, count }: Options) {
  if (duration && kind === "wait") return "waitFor";
  if (duration && kind === "every") return "everyFor";
  if (duration && kind === "within") return "withinFor";
  return count && kind === "repeat" ? "repeatFor" : kind;
}

function detectorContent(catalogue: Catalogue): TaskContent {
  const { content } = serviceBlock(catalogue, "Detector");
  return content as TaskContent;
}

function behaviorBlocks(catalogue: Catalogue, behavior: Behavior, index: number): Block[] {
  const candidates = catalogue.candidates(behavior);
  const groups = new Set(candidates.map((each) => groupOf(behavior, each)));
  return [...groups].map((group) => {
    const fitting = candidates.filter((each) => groupOf(behavior, each) === group);
    return {
      id: `behavior-${group}-${behavior.name}-${index}`,
      group,
      title: titleOf(behavior.name),
      doc: behavior.doc,
      word: behavior.name,
      content: { kind: "behavior", use: useOf(catalogue, behavior, fitting) },
    };
  });
}

function groupOf(behavior: Behavior, candidate: Candidate): BlockGroup {
  if (candidate.kind === "team") return "team";
  return behavior.type === "payload" ? "payload" : (candidate.domain ?? "ground");
}

/** A first version of a behavior: defaults, what can only be one, and one role. */
export function useOf(
  catalogue: Catalogue,
  behavior: Behavior,
  fitting: readonly Candidate[],
): BehaviorUse {
  const parameters = behavior.parameters
    .map((each) => ({ name: each.name, value: firstValue(catalogue, each) }))
    .filter((each) => each.value !== "");
  return {
    type: behavior.type,
    name: behavior.name,
    parameters,
    roles: [firstRole(catalogue, fitting, behavior.type)],
  };
}

function firstValue(catalogue: Catalogue, parameter: Parameter): string {
  const said = defaultOf(parameter);
  if (said || !parameter.required) return said;
  const fitting = catalogue.geometries.value.filter(({ kind }) => kind === parameter.kind);
  return fitting.length === 1 ? (fitting[0]?.name ?? "") : "";
}

/** The resource that can do it; none where several can: the user chooses. */
export function firstRole(
  catalogue: Catalogue,
  fitting: readonly Candidate[],
  otherwise: Role["kind"],
): Role {
  const [first] = fitting;
  return {
    name: roleName(catalogue, first),
    kind: first?.kind ?? otherwise,
    resource: fitting.length === 1 && first ? first.id : "",
    optional: false,
  };
}

export function roleName(catalogue: Catalogue, candidate: Candidate | undefined): string {
  if (candidate?.kind === "team") return "team";
  if (candidate?.kind === "payload") {
    const isDetector = catalogue.fleet.payloads.find(({ id }) => id === candidate.id)?.detector;
    return isDetector ? "sensor" : "camera";
  }
  return candidate?.domain === "air" ? "pilot" : "driver";
}

function serviceBlock(catalogue: Catalogue, name: string): Block {
  const detectors = name === "Detector" ? catalogue.detectors() : [];
  const roles = detectors.length === 1 ? [firstRole(catalogue, detectors, "payload")] : [];
  return {
    id: `service-${name}`,
    group: "service",
    title: name,
    doc: name === "Detector" ? strings.editor.blocks.detectorDoc : "",
    word: name,
    content: { kind: "service", use: { name, parameters: [], roles } },
  };
}

function promptBlock(): Block {
  const { askTitle, askDoc } = strings.editor.blocks;
  return {
    id: "prompt",
    group: "operator",
    title: askTitle,
    doc: askDoc,
    word: "prompt",
    content: { kind: "prompt" },
  };
}
