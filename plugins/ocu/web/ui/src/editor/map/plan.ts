// The map beside the diagram: what is selected, drawn and picked there. Each change of a route, area
// or point is a step of the diagram's undo and redo.
import { computed, signal, type ReadonlySignal } from "@preact/signals";
import { remember, remembered } from "../../shared/memory";
import type { Geometry, RunSummary } from "../../shared/types";
import { draftOf, emptyDraft, featureOf, type Draft, type Kind } from "../../map/draft";
import {
  putGeometries,
  removeGeometry,
  renameUses,
  surveyChanges,
  type NamedFeature,
} from "../moddle/geometries";
import type { ModdleElement } from "../moddle/moddle";
import { definitionsOf } from "../panels/drawn";
import type { EditorContext } from "../panels/panel";
import type { Element } from "../session/services";
import { commandsOf, inFlowOrder, type MapCommand } from "./commands";
import { renamedIn } from "./survey/pattern";
import { Surveys } from "./survey/surveys";

/** A parameter whose value is chosen on the map. */
export interface Picking {
  /** Of the parameter; a position is a point, or any place. */
  kind: Kind | "position";
  label: string;
  write(value: string): void;
}

/** Drawings of a file that wait to be taken. */
export interface Incoming {
  file: string;
  drawings: (NamedFeature & { kind: Kind; taken: boolean })[];
  problems: readonly string[];
}

export interface PlayedRehearsal {
  id: string;
  summary: RunSummary;
  /** The moment that is shown, in seconds; left out: it is played. */
  at?: number;
}

export class MapPlan {
  readonly isShown = signal(remembered("editor-map", false));
  /** The geometry that is looked at, by its name. */
  readonly selected = signal("");
  /** What is being drawn. */
  readonly draft = signal<Draft | null>(null);
  readonly picking = signal<Picking | null>(null);
  readonly incoming = signal<Incoming | null>(null);
  /** Played on the map. */
  readonly rehearsal = signal<PlayedRehearsal | null>(null);
  readonly commands: ReadonlySignal<readonly MapCommand[]>;
  readonly surveys: Surveys;

  constructor(private readonly editor: EditorContext) {
    this.commands = computed(() => {
      editor.changes.value;
      return commandsOf(definitionsOf(editor), editor.catalogue.geometries.value);
    });
    this.surveys = new Surveys(editor, this);
  }

  show(isShown: boolean): void {
    this.isShown.value = isShown;
    remember("editor-map", isShown);
    if (isShown) return;
    this.cancel();
    this.rehearsal.value = null;
  }

  play(rehearsal: PlayedRehearsal): void {
    this.show(true);
    this.cancel();
    this.selected.value = "";
    this.rehearsal.value = rehearsal;
  }

  cancel(): void {
    this.draft.value = null;
    this.picking.value = null;
    this.incoming.value = null;
    this.surveys.close();
  }

  find(name: string): Geometry | undefined {
    return this.editor.catalogue.geometries.value.find((each) => each.name === name);
  }

  begin(kind: Kind): void {
    this.surveys.close();
    this.selected.value = "";
    this.incoming.value = null;
    this.draft.value = { ...emptyDraft(kind), name: this.freeName(kind) };
  }

  /** What was drawn becomes the mission's, and the value that was to be picked. */
  finish(draft: Draft): void {
    this.draft.value = null;
    this.put([{ name: draft.name, feature: featureOf(draft) }]);
    this.selected.value = draft.name;
    this.pick(draft.name);
  }

  pick(value: string): void {
    const picking = this.picking.value;
    this.picking.value = null;
    picking?.write(value);
  }

  /** Whether the parameter that is picked for takes it. */
  fits(geometry: Geometry): boolean {
    const kind = this.picking.value?.kind;
    return kind === geometry.kind || (kind === "position" && geometry.kind === "point");
  }

  /** A new shape, altitude or name of one of the mission's. */
  change(draft: Draft, before = draft.name): void {
    const { factory } = this.editor.service("edits");
    const feature = featureOf(draft);
    const changes = putGeometries(factory, this.definitions(), [
      { name: draft.name, feature, before },
    ]);
    if (before !== draft.name) {
      for (const task of this.usersOf(before)) {
        const shown = this.editor.service("elementRegistry").get(String(task.get("id")));
        const renamed = renameUses(factory, task, before, draft.name);
        changes.push(...renamed.map((each) => ({ ...each, shown })));
      }
      changes.push(
        ...surveyChanges(this.definitions(), (text) => renamedIn(text, before, draft.name)),
      );
    }
    this.apply(changes);
    this.selected.value = draft.name;
    if (draft.kind === "area" && before === draft.name) this.surveys.areaChanged(draft.name);
  }

  put(features: readonly NamedFeature[], gone: readonly string[] = []): void {
    const { factory } = this.editor.service("edits");
    this.apply(putGeometries(factory, this.definitions(), features, gone));
  }

  /** The mission gets its own copy of one of the fleet's. */
  copy(geometry: Geometry): void {
    this.put([{ name: geometry.name, feature: featureOf(draftOf(geometry)) }]);
  }

  remove(name: string): void {
    const { factory } = this.editor.service("edits");
    this.apply(removeGeometry(factory, this.definitions(), name));
    this.selected.value = "";
  }

  usedBy(name: string): MapCommand[] {
    return this.commands.value.filter(({ geometry }) => geometry === name);
  }

  freeName(base: string, others: Iterable<string> = []): string {
    const taken = new Set([
      ...this.editor.catalogue.geometries.value.map(({ name }) => name),
      ...this.editor.catalogue.fleet.vehicles.map(({ id }) => id),
      ...others,
    ]);
    for (let number = 1; ; number += 1) {
      const name = `${base}${number}`;
      if (!taken.has(name)) return name;
    }
  }

  /** Whether nothing has that name; the mission may have its own in place of the fleet's. */
  isFree(name: string): boolean {
    const { own, fleet } = this.editor.catalogue;
    return (
      !own.value.some((each) => each.name === name) && !fleet.vehicles.some(({ id }) => id === name)
    );
  }

  /** Whether there is one of the fleet's in whose place it stands. */
  hides(name: string): boolean {
    return this.editor.catalogue.isShared(name);
  }

  private usersOf(name: string): ModdleElement[] {
    const users = new Set(this.usedBy(name).map(({ task }) => task));
    return inFlowOrder(this.definitions()).filter((each) => users.has(String(each.get("id"))));
  }

  private definitions(): ModdleElement {
    const found = definitionsOf(this.editor);
    if (!found) throw new Error("no mission is drawn yet");
    return found;
  }

  private apply(changes: ReturnType<typeof putGeometries>): void {
    const root = this.editor.service("canvas").getRootElement() as unknown as Element;
    if (changes.length > 0) this.editor.service("edits").apply(root, changes);
  }
}
