// Surveys of the mission: the one whose form is open, and those whose routes follow their areas.
import { computed, signal, type ReadonlySignal } from "@preact/signals";
import { get, post } from "../../../shared/api";
import { Latest } from "../../../shared/latest";
import { toast } from "../../../shared/Toasts";
import type { Geometry } from "../../../shared/types";
import { fill, strings } from "../../../strings";
import { behaviorName } from "../../blocks/naming";
import type { BehaviorUse } from "../../moddle/behavior";
import { roleName } from "../../blocks/blocks";
import type { Fragment, FragmentNode } from "../../blocks/control/fragment";
import { isA, list, type ModdleElement } from "../../moddle/moddle";
import type { NamedFeature } from "../../moddle/geometries";
import type { EditorContext } from "../../panels/panel";
import type { Element } from "../../session/services";
import type { MapPlan } from "../plan";
import {
  namesArea,
  patternOf,
  readPattern,
  requestOf,
  writePattern,
  type KnownCamera,
  type Pattern,
  type SurveyRoutes,
} from "./pattern";

const words = strings.survey;
const PAUSE_MS = 120;
const FOLLOW = "single_vehicle_routing";
const ROW_PX = 110;
const TASK_PX = [140, 280] as const;

/** A survey that is drawn or changed in its form. */
export interface OpenSurvey {
  pattern: Pattern;
  /** Of its routes. */
  base: string;
  /** What the routes that it changes have as their pattern; "": it makes new ones. */
  before: string;
}

export interface Preview {
  routes: SurveyRoutes | null;
  /** Why there are none; "": there are, or they are being calculated. */
  problem: string;
  isWorking: boolean;
}

const NOTHING: Preview = { routes: null, problem: "", isWorking: false };

export class Surveys {
  readonly open = signal<OpenSurvey | null>(null);
  readonly preview = signal<Preview>(NOTHING);
  readonly cameras = signal<readonly KnownCamera[]>([]);
  /** Vehicles that can follow a route. */
  readonly vehicles: ReadonlySignal<readonly string[]>;
  private readonly latest: Latest<Pattern, SurveyRoutes>;
  private remade = 0;

  constructor(
    private readonly editor: EditorContext,
    private readonly plan: MapPlan,
  ) {
    this.vehicles = computed(() => {
      const { catalogue } = editor;
      const follow = catalogue.behaviors.filter(({ name, type }) => name === FOLLOW && type === "vehicle");
      const able = new Set(
        follow.flatMap((each) => catalogue.candidates(each)).map(({ id }) => id),
      );
      return catalogue.fleet.vehicles.map(({ id }) => id).filter((id) => able.has(id));
    });
    this.latest = new Latest(
      (pattern) => this.ask(pattern),
      {
        answer: (routes) => (this.preview.value = { routes, problem: "", isWorking: false }),
        failed: (error) =>
          (this.preview.value = {
            routes: null,
            problem: fill(words.failed, { reason: reasonOf(error) }),
            isWorking: false,
          }),
      },
      PAUSE_MS,
    );
  }

  /** A new survey of an area. */
  begin(area: string): void {
    this.show({ pattern: patternOf(area), base: this.plan.freeName(`${area}-survey`), before: "" });
  }

  /** The survey that a route is a part of. */
  change({ survey, name }: Geometry): void {
    const pattern = survey && readPattern(survey.pattern);
    if (!pattern) return;
    const end = survey.surveyor && `-${survey.surveyor}`;
    const base = end && name.endsWith(end) ? name.slice(0, -end.length) : name;
    this.show({ pattern, base, before: survey.pattern });
  }

  set(pattern: Partial<Pattern> | Pattern): void {
    const open = this.open.value;
    if (open) this.show({ ...open, pattern: { ...open.pattern, ...pattern } });
  }

  /** All of it: what is left out is none any more. */
  replace(pattern: Pattern): void {
    const open = this.open.value;
    if (open) this.show({ ...open, pattern });
  }

  setBase(base: string): void {
    const open = this.open.value;
    if (open) this.open.value = { ...open, base };
  }

  close(): void {
    this.latest.clear();
    this.open.value = null;
    this.preview.value = NOTHING;
  }

  /** The names that the routes get: those that they have, as tasks name them. */
  names(): Map<string, string> {
    const { open } = this;
    const { before = "", base = "", pattern } = open.value ?? {};
    const had = this.routesOf(before);
    const isAlone = (pattern?.vehicles.length ?? 0) < 2;
    return new Map(
      (this.preview.value.routes?.routes ?? []).map(({ vehicle }) => [
        vehicle,
        had.find(({ survey }) => survey?.surveyor === vehicle)?.name ??
          (isAlone || !vehicle ? base : `${base}-${vehicle}`),
      ]),
    );
  }

  /** Whether the names can be used. */
  isNamed(): boolean {
    const had = new Set(this.routesOf(this.open.value?.before ?? "").map(({ name }) => name));
    return [...this.names().values()].every(
      (name) => had.has(name) || (/^[\w.-]{1,100}$/.test(name) && this.plan.isFree(name)),
    );
  }

  /** The routes become the mission's, with a task for each vehicle if there shall be some. */
  make(withTasks: boolean): void {
    const open = this.open.value;
    const { routes } = this.preview.value;
    if (!open || !routes || routes.routes.length === 0) return;
    const names = this.names();
    const features = this.featuresOf(open.pattern, routes, names);
    const gone = this.routesOf(open.before)
      .map(({ name }) => name)
      .filter((name) => ![...names.values()].includes(name));
    this.editor.service("edits").together(() => {
      this.plan.put(features, gone);
      if (withTasks) this.putTasks(names);
    });
    this.close();
    this.plan.selected.value = features[0]!.name;
    toast(fill(words.made, { names: features.map(({ name }) => name).join(", ") }), "good");
  }

  /** Routes that survey an area, or keep out of it, are made again when it has another shape. */
  areaChanged(area: string): void {
    const patterns = new Set(
      this.editor.catalogue.own.peek().flatMap(({ survey }) => (survey ? [survey.pattern] : [])),
    );
    const mine = ++this.remade;
    for (const text of patterns) {
      const pattern = readPattern(text);
      if (pattern && namesArea(pattern, area)) void this.remake(text, pattern, mine);
    }
  }

  private async remake(text: string, pattern: Pattern, mine: number): Promise<void> {
    try {
      const routes = await this.ask(pattern);
      const had = this.routesOf(text);
      if (mine !== this.remade || had.length === 0) return;
      const names = new Map(had.map(({ name, survey }) => [survey?.surveyor ?? "", name]));
      const base = had[0]!.name;
      for (const { vehicle } of routes.routes) {
        if (!names.has(vehicle)) names.set(vehicle, this.plan.freeName(`${base}-`));
      }
      const made = new Set(routes.routes.map(({ vehicle }) => vehicle));
      const gone = had.flatMap((each) => (made.has(each.survey?.surveyor ?? "") ? [] : each.name));
      this.plan.put(this.featuresOf(pattern, routes, names), gone);
      toast(fill(words.remade, { area: pattern.area }));
    } catch (error) {
      const reason = reasonOf(error);
      toast(fill(words.notRemade, { area: pattern.area, reason }), "bad");
    }
  }

  private show(open: OpenSurvey): void {
    this.open.value = open;
    this.preview.value = { ...this.preview.value, problem: "", isWorking: true };
    this.latest.soon(open.pattern);
    if (this.cameras.peek().length === 0) void this.loadCameras();
  }

  private async loadCameras(): Promise<void> {
    try {
      this.cameras.value = await get<KnownCamera[]>("/survey-cameras");
    } catch {
      // The numbers of a camera can be written all the same.
    }
  }

  private async ask(pattern: Pattern): Promise<SurveyRoutes> {
    const request = requestOf(pattern, (name) => {
      const found = this.plan.find(name);
      return found?.kind === "area" ? found.geometry : undefined;
    });
    if (typeof request === "string") throw new Error(fill(words.noArea, { area: request }));
    return await post<SurveyRoutes>("/survey-patterns", request);
  }

  private routesOf(text: string): Geometry[] {
    return text === ""
      ? []
      : this.editor.catalogue.own.peek().filter(({ survey }) => survey?.pattern === text);
  }

  private featuresOf(
    pattern: Pattern,
    { routes }: SurveyRoutes,
    names: ReadonlyMap<string, string>,
  ): NamedFeature[] {
    const text = writePattern(pattern);
    return routes.map(({ vehicle, geojson }) => ({
      name: names.get(vehicle)!,
      feature: geojson,
      survey: { pattern: text, surveyor: vehicle },
    }));
  }

  /** Behind what is selected, else behind what leads nowhere yet; all vehicles at once. */
  private putTasks(names: ReadonlyMap<string, string>): void {
    const fragments = this.editor.service("fragments");
    const fragment = this.tasksOf(names);
    const at = this.place();
    if (at) return fragments.put(fragment, at);
    const canvas = this.editor.service("canvas");
    const { x, y, width, height } = canvas.viewbox();
    const middle = { x: Math.round(x + width / 2), y: Math.round(y + height / 2) };
    fragments.putAt(fragment, middle, canvas.getRootElement() as unknown as Element);
  }

  private place(): Element | undefined {
    const may = (element: Element) =>
      Boolean(this.editor.service("rules").allowed("shape.append", { element }));
    const [selected, ...more] = this.editor.selected.peek();
    if (selected && more.length === 0 && may(selected)) return selected;
    const all = this.editor.service("elementRegistry").filter((each) => {
      const object = each.businessObject as ModdleElement | undefined;
      return (
        isA(object, "bpmn:FlowNode") &&
        !isA(object, "bpmn:EndEvent") &&
        !("labelTarget" in each && each.labelTarget) &&
        list(object, "outgoing").length === 0
      );
    });
    return (all as unknown as Element[]).filter(may).at(-1);
  }

  private tasksOf(names: ReadonlyMap<string, string>): Fragment {
    const all = [...names];
    const nodes = all.map(([vehicle, route], index): FragmentNode => {
      const use = this.useOf(vehicle, route);
      return {
        id: `task${index}`,
        type: "bpmn:ScriptTask",
        name: behaviorName(this.editor.catalogue, use),
        at: [all.length < 2 ? 0 : TASK_PX[0], (index - (all.length - 1) / 2) * ROW_PX],
        content: { kind: "behavior", use },
      };
    });
    const [first] = nodes;
    if (nodes.length < 2) return { nodes, flows: [], entry: first!.id, exit: first!.id };
    const gateway = (id: string, name: string, x: number): FragmentNode => ({
      id,
      type: "bpmn:ParallelGateway",
      name,
      at: [x, 0],
    });
    return {
      nodes: [gateway("fork", words.fork, 0), ...nodes, gateway("join", words.join, TASK_PX[1])],
      flows: nodes.flatMap(({ id }) => [
        { from: "fork", to: id },
        { from: id, to: "join" },
      ]),
      entry: "fork",
      exit: "join",
    };
  }

  private useOf(vehicle: string, route: string): BehaviorUse {
    const { catalogue } = this.editor;
    const candidate = catalogue.everybody("vehicle").find(({ id }) => id === vehicle);
    return {
      type: "vehicle",
      name: FOLLOW,
      parameters: [{ name: "route", value: route }],
      roles: [
        {
          name: roleName(catalogue, candidate),
          kind: "vehicle",
          resource: vehicle,
          optional: false,
        },
      ],
    };
  }
}

const reasonOf = (error: unknown): string =>
  error instanceof Error ? error.message : String(error);
