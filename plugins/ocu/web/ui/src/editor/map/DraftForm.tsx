// What is drawn anew: how many vertices it has, and by numbers for the keyboard.
import { LEAST, moved, removed, type Draft } from "../../map/draft";
import { area_m2, length_m, writtenArea, writtenLength } from "../../map/measure";
import { VertexList } from "../../map/VertexList";
import { fill, strings } from "../../strings";

const words = strings.plan;
const text = strings.operate.map;

export interface DraftFormProps {
  draft: Draft;
  change(draft: Draft): void;
  addMiddle(): void;
  undo(): void;
  done(): void;
  cancel(): void;
}

export function DraftForm({ draft, change, addMiddle, undo, done, cancel }: DraftFormProps) {
  const { kind, vertices, before } = draft;
  const lacks = vertices.length < LEAST[kind];
  return (
    <form
      class="plan-form"
      aria-label={fill(words.drawing, { kind: text.kinds[kind] })}
      onSubmit={(event) => {
        event.preventDefault();
        if (!lacks) done();
      }}
    >
      <p class="plan-sizes" role="status">
        <strong>{fill(words.drawing, { kind: text.kinds[kind] })}</strong>
        {lacks ? ` ${text.needs[kind]}. ${words.drawHint[kind]}.` : ` ${sizesOf(draft)}`}
      </p>
      <details>
        <summary>{fill(words.vertices, { count: vertices.length })}</summary>
        <VertexList
          vertices={vertices}
          hasSpeeds={kind === "route"}
          move={(index, to) => change(moved(draft, index, to))}
          remove={(index) => change(removed(draft, index))}
        />
      </details>
      <div class="plan-actions">
        <button type="button" class="secondary" onClick={addMiddle}>
          {text.addCentre}
        </button>
        <button type="button" class="secondary" disabled={before.length === 0} onClick={undo}>
          {words.undoVertex}
        </button>
        <span class="plan-space" />
        <button type="button" class="secondary" onClick={cancel}>
          {words.cancel}
        </button>
        <button class="primary" disabled={lacks}>
          {words.done}
        </button>
      </div>
    </form>
  );
}

/** `Length 1.2 km`, `Area 3 ha · Around 800 m`. */
export function sizesOf({ kind, vertices }: Draft): string {
  const isArea = kind === "area";
  const length = writtenLength(length_m(vertices, isArea));
  if (kind === "point") return "";
  if (!isArea) return fill(words.length, { length });
  const area = fill(words.area, { area: writtenArea(area_m2(vertices)) });
  return `${area} · ${fill(words.perimeter, { length })}`;
}
