// The versions of a drawing: who handed over what, and when. One is looked at on the map beside what
// is there now, and handed over again.
import { useSignal, type Signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { ApiError, get, remove } from "../../shared/api";
import { order } from "../../shared/command";
import { dateTime } from "../../shared/format";
import { may } from "../../shared/session";
import { attempt, toast } from "../../shared/Toasts";
import type { AltitudeFrame, Geometry } from "../../shared/types";
import { fill, strings } from "../../strings";
import { draftOf } from "../../map/draft";
import { withOwn } from "../../map/ownGeometry";
import { useOperating } from "../context";
import "./draw.css";
import "./versions.css";

const text = strings.operate.map;
const words = text.versions;

interface Version {
  number: number;
  kind: Geometry["kind"] | null;
  geometry: GeoJSON.Geometry | null;
  altitude_frame: AltitudeFrame;
  by: string;
  at_us: number;
}

/** What waits for a yes: a version that is to come back, or the deletion. */
interface Asked {
  version: number | null;
  why: string;
}

/** `name`: of the drawing; "" closes. `compared`: the version that the map shows. */
export default function VersionsPanel({
  name,
  compared,
}: {
  name: Signal<string>;
  compared: Signal<GeoJSON.Geometry | null>;
}) {
  const { geometries } = useOperating();
  const of = name.value;
  const versions = useSignal<readonly Version[] | null>(null);
  const looked = useSignal(0);
  const asked = useSignal<Asked | null>(null);
  const title = useRef<HTMLHeadingElement>(null);
  const isDrawn = geometries.value.some((each) => each.name === of && each.from === "operator");

  const load = () =>
    attempt(async () => {
      const found = await get<Version[]>(`/geometries/${encodeURIComponent(of)}/versions`);
      versions.value = [...found].reverse();
    });
  useEffect(() => {
    title.current?.focus();
    void load();
    return () => (compared.value = null);
  }, [of]);

  const reload = async () => {
    compared.value = null;
    looked.value = 0;
    asked.value = null;
    const own = geometries.value.filter(({ from }) => from === "mission");
    await attempt(
      async () => (geometries.value = withOwn(own, await get<Geometry[]>("/geometries"))),
    );
    await load();
  };
  const restore = async (version: number, force: boolean) => {
    const path = `/geometries/${encodeURIComponent(of)}/versions/${version}/restore`;
    try {
      await order(path, { force });
    } catch (error) {
      const runs = error instanceof ApiError ? error.problem.runs : undefined;
      if (Array.isArray(runs)) {
        asked.value = { version, why: fill(words.used, { name: of, runs: runs.join(", ") }) };
      } else toast(error instanceof Error ? error.message : String(error), "bad");
      return;
    }
    toast(fill(words.restored, { name: of, version }), "good");
    await reload();
  };
  const deleteIt = async () => {
    if (await attempt(() => remove(`/geometries/${encodeURIComponent(of)}`))) {
      toast(fill(words.deleted, { name: of }), "good");
      await reload();
    }
  };
  const look = ({ number, geometry }: Version) => {
    const again = looked.value === number;
    looked.value = again ? 0 : number;
    compared.value = again ? null : geometry;
  };

  return (
    <section
      class="draw-form versions"
      aria-label={fill(words.title, { name: of })}
      onKeyDown={(event) => {
        if (event.key === "Escape" && !event.shiftKey) name.value = "";
      }}
    >
      <div class="versions-head">
        <h2 ref={title} tabIndex={-1}>
          {fill(words.title, { name: of })}
        </h2>
        {isDrawn && may("operator") && (
          <button
            type="button"
            class="secondary"
            onClick={() =>
              (asked.value = { version: null, why: fill(words.deletes, { name: of }) })
            }
          >
            {words.delete}
          </button>
        )}
        <button
          type="button"
          class="plain"
          aria-label={words.close}
          onClick={() => (name.value = "")}
        >
          ×
        </button>
      </div>
      {asked.value && (
        <div class="versions-asked" role="alert">
          <p>{asked.value.why}</p>
          <button type="button" class="secondary" onClick={() => (asked.value = null)}>
            {text.cancel}
          </button>
          <button
            type="button"
            class="primary"
            onClick={() => {
              const version = asked.value?.version ?? null;
              void (version === null ? deleteIt() : restore(version, true));
            }}
          >
            {asked.value.version === null ? words.delete : text.replace}
          </button>
        </div>
      )}
      {versions.value?.length === 0 && <p class="hint">{words.none}</p>}
      <ol class="versions-list">
        {(versions.value ?? []).map((version, index) => (
          <li key={version.number}>
            <span>
              <strong>{whatOf(of, version)}</strong>
              {index === 0 && ` · ${words.latest}`}
              <br />
              {fill(words.by, { by: version.by || words.unknown, at: dateTime(version.at_us) })}
            </span>
            {version.geometry && (
              <button
                type="button"
                class="secondary"
                aria-pressed={looked.value === version.number}
                aria-label={fill(words.lookAt, { version: version.number })}
                onClick={() => look(version)}
              >
                {words.look}
              </button>
            )}
            {version.geometry && (index > 0 || !isDrawn) && may("operator") && (
              <button
                type="button"
                class="secondary"
                aria-label={fill(words.restoreIt, { version: version.number })}
                onClick={() => void restore(version.number, false)}
              >
                {words.restore}
              </button>
            )}
          </li>
        ))}
      </ol>
    </section>
  );
}

function whatOf(name: string, { number, kind, geometry, altitude_frame, by, at_us }: Version) {
  if (!kind || !geometry) return fill(words.wasDeleted, { version: number });
  const drawn = draftOf({ name, kind, geometry, altitude_frame, by, at_us, from: "operator" });
  const count = drawn.vertices.length;
  return fill(words.is, { version: number, kind: text.kinds[kind], count });
}
