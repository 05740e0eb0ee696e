// What this fleet has and can do: behaviors, services, vehicles, payloads, teams, routes and areas.
import { computed, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import { withOwn } from "../../map/ownGeometry";
import { get } from "../../shared/api";
import type { Behavior, Fleet, Geometry } from "../../shared/types";
import type { Dialects } from "../condition/dialect";
import type { BehaviorUse, ResourceKind } from "../moddle/behavior";

export interface Service {
  name: string;
  writes: string[];
}

export type Domain = Fleet["vehicles"][number]["domain"];

/** Somebody who can do something. */
export interface Candidate {
  kind: ResourceKind;
  id: string;
  /** Of a vehicle, or of the vehicle that carries a payload. */
  domain?: Domain;
}

export class Catalogue {
  /** Those of the mission stand in place of others of their names. */
  readonly geometries: ReadonlySignal<readonly Geometry[]>;
  /** Of the mission that is drawn. */
  readonly own = signal<readonly Geometry[]>([]);
  private readonly shared: Signal<readonly Geometry[]>;

  constructor(
    readonly fleet: Fleet,
    readonly behaviors: readonly Behavior[],
    readonly services: readonly Service[],
    geometries: Geometry[],
    readonly dialects: Dialects,
  ) {
    this.shared = signal(geometries);
    this.geometries = computed(() => withOwn(this.own.value, this.shared.value));
  }

  static async load(): Promise<Catalogue> {
    const [fleet, behaviors, services, geometries, dialects] = await Promise.all([
      get<Fleet>("/fleet"),
      get<Behavior[]>("/behaviors"),
      get<Service[]>("/services"),
      get<Geometry[]>("/geometries"),
      get<Dialects>("/expressions"),
    ]);
    return new Catalogue(fleet, behaviors, services, geometries, dialects);
  }

  /** Routes, areas and points may have been drawn meanwhile. */
  async refreshGeometries(): Promise<void> {
    this.shared.value = await get<Geometry[]>("/geometries");
  }

  /** Whether the fleet, or an operator, has a geometry of that name. */
  isShared(name: string): boolean {
    return this.shared.value.some((each) => each.name === name);
  }

  domainOf(resource: string): Domain | undefined {
    const [vehicle] = resource.split("/");
    return this.fleet.vehicles.find(({ id }) => id === vehicle)?.domain;
  }

  /** The resources that can do a behavior; a manned vehicle is never commanded. */
  candidates(behavior: Behavior): Candidate[] {
    const manned = new Set(this.fleet.vehicles.filter((each) => each.manned).map(({ id }) => id));
    const kind = behavior.type === "payload" ? "payload" : "vehicle";
    const alone = behavior.resources
      .filter((id) => !manned.has(id))
      .map((id) => this.candidate(kind, id));
    return [...alone, ...behavior.teams.map((id): Candidate => ({ kind: "team", id }))];
  }

  detectors(): Candidate[] {
    const found = this.fleet.payloads.filter((each) => each.detector);
    return found.map(({ id }) => this.candidate("payload", id));
  }

  everybody(kind: ResourceKind): Candidate[] {
    const { vehicles, payloads, teams } = this.fleet;
    if (kind === "team") return teams.map(({ name }) => ({ kind, id: name }));
    const all = kind === "vehicle" ? vehicles.filter((each) => !each.manned) : payloads;
    return all.map(({ id }) => this.candidate(kind, id));
  }

  /** The entry of the catalogue that a task means: arbiters may differ in what they take. */
  meant(use: BehaviorUse): Behavior | undefined {
    const named = this.behaviors.filter((each) => each.type === use.type && each.name === use.name);
    const resources = use.roles.map((role) => role.resource);
    const fits = named.find((each) =>
      resources.some((id) => each.resources.includes(id) || each.teams.includes(id)),
    );
    return fits ?? named[0];
  }

  private candidate(kind: ResourceKind, id: string): Candidate {
    const domain = this.domainOf(id);
    return domain ? { kind, id, domain } : { kind, id };
  }
}
