// The geometry that is selected: its name, its altitudes, its sizes, and who uses it.
import { useState } from "preact/hooks";
import { Dialog } from "../../shared/Dialog";
import type { AltitudeFrame, Geometry } from "../../shared/types";
import { draftOf, inFrame, isMixed, LEAST, moved, removed, type Draft } from "../../map/draft";
import { VertexList } from "../../map/VertexList";
import { fill, strings } from "../../strings";
import type { EditorContext } from "../panels/panel";
import { sizesOf } from "./DraftForm";
import { SurveyButton } from "./survey/SurveyButton";
import { TerrainProfile } from "./terrain/TerrainProfile";

const words = strings.plan;
const text = strings.operate.map;
const FRAMES: readonly AltitudeFrame[] = ["relative", "amsl", "terrain", "ellipsoid"];

export interface GeometryFormProps {
  editor: EditorContext;
  geometry: Geometry;
}

export function GeometryForm({ editor, geometry }: GeometryFormProps) {
  const { plan } = editor;
  const draft = draftOf(geometry);
  const isOwn = geometry.from === "mission";
  const close = () => (plan.selected.value = "");
  return (
    <form
      class="plan-form"
      aria-label={fill(words.titled, { kind: text.kinds[geometry.kind], name: geometry.name })}
      onSubmit={(event) => event.preventDefault()}
    >
      {isOwn ? (
        <Own editor={editor} draft={draft} />
      ) : (
        <div class="plan-row">
          <strong>
            {fill(words.titled, { kind: text.kinds[geometry.kind], name: geometry.name })}
          </strong>
          <span>
            {geometry.from === "fleet" ? words.ofFleet : fill(words.ofOperator, { by: geometry.by })}
          </span>
          <span class="plan-space" />
          <button type="button" class="secondary" onClick={() => plan.copy(geometry)}>
            {words.copy}
          </button>
          <button type="button" class="plain" aria-label={words.close} onClick={close}>
            ×
          </button>
        </div>
      )}
      <p class="plan-sizes">
        {sizesOf(draft)}
        <Users editor={editor} name={geometry.name} />
      </p>
      <SurveyButton surveys={plan.surveys} geometry={geometry} />
      {geometry.kind === "route" && <TerrainProfile editor={editor} geometry={geometry} />}
    </form>
  );
}

function Own({ editor, draft }: { editor: EditorContext; draft: Draft }) {
  const { plan } = editor;
  const [wrong, setWrong] = useState("");
  const [altitude, setAltitude] = useState("");
  const [asks, setAsks] = useState(false);
  const { name, kind, vertices } = draft;
  const rename = (to: string) => {
    if (to === name) return setWrong("");
    if (!/^[\w.-]{1,100}$/.test(to)) return setWrong(text.needsName);
    if (!plan.isFree(to)) return setWrong(words.nameTaken);
    setWrong("");
    plan.change({ ...draft, name: to }, name);
  };
  const users = [...new Set(plan.usedBy(name).map(({ title }) => title))];
  const toAll = altitude === "" ? null : Number(altitude);
  return (
    <>
      <div class="plan-row">
        <label>
          {words.name}
          <input
            value={name}
            spellcheck={false}
            aria-invalid={wrong !== ""}
            onChange={({ currentTarget }) => rename(currentTarget.value.trim())}
          />
        </label>
        <label>
          {text.above}
          <select
            value={isMixed(draft) ? "" : (draft.vertices[0]?.frame ?? draft.frame)}
            onChange={({ currentTarget }) =>
              plan.change(inFrame(draft, currentTarget.value as AltitudeFrame))
            }
          >
            {FRAMES.map((frame) => (
              <option key={frame} value={frame}>
                {text.frames[frame]}
              </option>
            ))}
          </select>
        </label>
        {kind !== "area" && (
          <label>
            {words.altitude}
            <span class="plan-set">
              <input
                type="number"
                step="any"
                value={altitude}
                onInput={({ currentTarget }) => setAltitude(currentTarget.value)}
              />
              <button
                type="button"
                class="secondary"
                onClick={() =>
                  plan.change({
                    ...draft,
                    vertices: vertices.map((each) => ({ ...each, altitude: toAll })),
                  })
                }
              >
                {words.setAltitude}
              </button>
            </span>
          </label>
        )}
        <span class="plan-space" />
        <button
          type="button"
          class="secondary"
          onClick={() => (users.length > 0 ? setAsks(true) : plan.remove(name))}
        >
          {words.remove}
        </button>
        <button
          type="button"
          class="plain"
          aria-label={words.close}
          onClick={() => (plan.selected.value = "")}
        >
          ×
        </button>
      </div>
      {wrong && (
        <p class="plan-wrong" role="alert">
          {wrong}
        </p>
      )}
      <details>
        <summary>{fill(words.vertices, { count: vertices.length })}</summary>
        <VertexList
          vertices={vertices}
          hasSpeeds={kind === "route"}
          move={(index, to) => plan.change(moved(draft, index, to))}
          remove={(index) => {
            if (vertices.length > LEAST[kind]) plan.change(removed(draft, index));
          }}
        />
      </details>
      {asks && (
        <Dialog
          title={fill(words.removeTitle, { name })}
          onClose={() => setAsks(false)}
          actions={
            <>
              <button type="button" class="secondary" onClick={() => setAsks(false)}>
                {words.cancel}
              </button>
              <button type="button" class="primary" onClick={() => plan.remove(name)}>
                {words.remove}
              </button>
            </>
          }
        >
          <p>
            {fill(plan.hides(name) ? words.removeTextFleet : words.removeText, {
              tasks: users.join(", "),
            })}
          </p>
        </Dialog>
      )}
    </>
  );
}

/** Links to the tasks; a click shows one on the diagram. */
function Users({ editor, name }: { editor: EditorContext; name: string }) {
  const users = editor.plan.usedBy(name);
  if (users.length === 0) return <span class="plan-users"> {words.notUsed}</span>;
  return (
    <span class="plan-users">
      {` ${words.usedBy} `}
      {users.map(({ task, number, title }) => (
        <button
          key={`${task} ${number}`}
          type="button"
          class="m2-link-button"
          onClick={() => void editor.select(task)}
        >
          {number} {title}
        </button>
      ))}
    </span>
  );
}
