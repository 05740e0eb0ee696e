// The form of a survey: how an area is covered, by whom, and what that takes. The map shows the
// passes as it changes.
import { area_m2, writtenArea, writtenLength } from "../../../map/measure";
import { draftOf } from "../../../map/draft";
import { clock } from "../../../shared/format";
import type { AltitudeFrame } from "../../../shared/types";
import { fill, strings } from "../../../strings";
import type { EditorContext } from "../../panels/panel";
import { NumberField, Slider } from "./fields";
import { spacedBy, type Camera, type Pattern, type SurveyRoutes } from "./pattern";
import type { Surveys } from "./surveys";
import "./survey.css";

const words = strings.survey;
const frames = strings.operate.map.frames;
const FRAMES: readonly AltitudeFrame[] = ["relative", "terrain", "amsl"];
const CORNERS = [0, 1, 2, 3] as const;
const PERCENT = 100;

interface Part {
  surveys: Surveys;
  pattern: Pattern;
}

export function SurveyForm({ editor }: { editor: EditorContext }) {
  const { plan } = editor;
  const { surveys } = plan;
  const open = surveys.open.value;
  if (!open) return null;
  const { pattern, base, before } = open;
  const title = fill(words.title, { area: pattern.area });
  const { routes, problem, isWorking } = surveys.preview.value;
  const isNamed = surveys.isNamed();
  const mayMake = Boolean(routes?.routes.length) && !isWorking && isNamed;
  return (
    <form
      class="plan-form survey-form"
      aria-label={title}
      onSubmit={(event) => {
        event.preventDefault();
        if (mayMake) surveys.make(false);
      }}
    >
      <div class="plan-row">
        <strong>{title}</strong>
        <span class="plan-space" />
        <button
          type="button"
          class="plain"
          aria-label={words.close}
          onClick={() => surveys.close()}
        >
          ×
        </button>
      </div>
      <div class="survey-columns">
        <div>
          <Spacing surveys={surveys} pattern={pattern} />
          <Heading surveys={surveys} pattern={pattern} />
          <More editor={editor} pattern={pattern} />
        </div>
        <div>
          <Vehicles surveys={surveys} pattern={pattern} />
          {problem ? (
            <p class="plan-wrong" role="alert">
              {problem}
            </p>
          ) : (
            routes && <Numbers editor={editor} pattern={pattern} routes={routes} />
          )}
          <p class="survey-working" role="status">
            {isWorking ? words.working : ""}
          </p>
        </div>
      </div>
      <div class="plan-actions">
        <label class="plan-field">
          {pattern.vehicles.length > 1 ? words.names : words.name}
          <input
            value={base}
            spellcheck={false}
            aria-invalid={!isNamed}
            onInput={({ currentTarget }) => surveys.setBase(currentTarget.value.trim())}
          />
        </label>
        {!isNamed && (
          <p class="plan-wrong" role="alert">
            {words.nameWrong}
          </p>
        )}
        <span class="plan-space" />
        <button class={before ? "primary" : "secondary"} disabled={!mayMake}>
          {before ? words.makeAgain : words.make}
        </button>
        {!before && pattern.vehicles.length > 0 && (
          <button
            type="button"
            class="primary"
            disabled={!mayMake}
            onClick={() => surveys.make(true)}
          >
            {words.makeTasks}
          </button>
        )}
      </div>
    </form>
  );
}

function Spacing({ surveys, pattern }: Part) {
  const { camera, spacing_m, altitude_m, altitude_frame } = pattern;
  const by = camera ? "camera" : "spacing";
  return (
    <>
      <fieldset class="survey-by">
        <legend>{words.spacingBy}</legend>
        {(["spacing", "camera"] as const).map((each) => (
          <label key={each}>
            <input
              type="radio"
              name="survey-by"
              checked={by === each}
              onChange={() => surveys.replace(spacedBy(pattern, each))}
            />
            {words.by[each]}
          </label>
        ))}
      </fieldset>
      {camera ? (
        <CameraFields surveys={surveys} pattern={pattern} camera={camera} />
      ) : (
        <Slider
          label={words.spacing}
          value={spacing_m ?? 0}
          min={1}
          max={200}
          most={10_000}
          step={1}
          set={(value) => surveys.set({ spacing_m: value })}
        />
      )}
      <Slider
        label={words.altitude}
        value={altitude_m ?? 0}
        min={camera ? 1 : 0}
        max={120}
        most={10_000}
        step={1}
        set={(value) => surveys.set({ altitude_m: value })}
      />
      <label class="plan-field plan-beside">
        {words.above}
        <select
          value={altitude_frame}
          onChange={({ currentTarget }) =>
            surveys.set({ altitude_frame: currentTarget.value as AltitudeFrame })
          }
        >
          {FRAMES.filter((frame) => !camera || frame !== "amsl").map((frame) => (
            <option key={frame} value={frame}>
              {frames[frame]}
            </option>
          ))}
        </select>
      </label>
    </>
  );
}

const NUMBERS: readonly [keyof Camera, string][] = [
  ["sensor_width_mm", words.sensorWidth],
  ["sensor_height_mm", words.sensorHeight],
  ["focal_length_mm", words.focalLength],
  ["image_width_px", words.imageWidth],
  ["image_height_px", words.imageHeight],
];

function CameraFields({
  surveys,
  camera,
}: Part & { camera: NonNullable<Pattern["camera"]> }) {
  const cameras = surveys.cameras.value;
  const known = cameras.find((each) => NUMBERS.every(([name]) => each[name] === camera[name]));
  const set = (to: Partial<NonNullable<Pattern["camera"]>>) =>
    surveys.set({ camera: { ...camera, ...to } });
  const overlap = (name: "front_overlap" | "side_overlap", label: string) => (
    <Slider
      label={label}
      value={Math.round(camera[name] * PERCENT)}
      min={0}
      max={95}
      step={1}
      set={(value) => set({ [name]: value / PERCENT })}
    />
  );
  return (
    <>
      <label class="plan-field plan-beside">
        {words.camera}
        <select
          value={known?.name ?? ""}
          onChange={({ currentTarget }) => {
            const chosen = cameras.find(({ name }) => name === currentTarget.value);
            if (chosen) set(Object.fromEntries(NUMBERS.map(([name]) => [name, chosen[name]])));
          }}
        >
          <option value="">{words.ownCamera}</option>
          {cameras.map(({ name }) => (
            <option key={name} value={name}>
              {name}
            </option>
          ))}
        </select>
      </label>
      <details class="survey-sensor" open={cameras.length > 0 && !known}>
        <summary>{words.ownCamera}</summary>
        <div class="plan-row">
          {NUMBERS.map(([name, label]) => (
            <NumberField
              key={name}
              label={label}
              value={camera[name]}
              min={name.endsWith("px") ? 1 : 0.1}
              max={name.endsWith("px") ? 1_000_000 : 1000}
              step={name.endsWith("px") ? 1 : "any"}
              set={(value) => set({ [name]: value ?? camera[name] })}
            />
          ))}
        </div>
      </details>
      {overlap("front_overlap", words.frontOverlap)}
      {overlap("side_overlap", words.sideOverlap)}
    </>
  );
}

function Heading({ surveys, pattern }: Part) {
  const best = surveys.preview.value.routes?.best_heading_deg;
  return (
    <>
      <Slider
        label={words.heading}
        value={Math.round(pattern.heading_deg ?? best ?? 0)}
        min={0}
        max={359}
        most={360}
        step={1}
        set={(value) => surveys.set({ heading_deg: value })}
      />
      <label class="survey-check">
        <input
          type="checkbox"
          checked={pattern.heading_deg === null}
          onChange={({ currentTarget }) =>
            surveys.set({ heading_deg: currentTarget.checked ? null : Math.round(best ?? 0) })
          }
        />
        {best === undefined
          ? words.bestHeadingUnknown
          : fill(words.bestHeading, { heading: Math.round(best) })}
      </label>
    </>
  );
}

function More({ editor, pattern }: { editor: EditorContext; pattern: Pattern }) {
  const { surveys } = editor.plan;
  const areas = editor.catalogue.geometries.value.filter(
    ({ kind, name }) => kind === "area" && name !== pattern.area,
  );
  const kept = new Set(pattern.keep_out);
  return (
    <details class="survey-more">
      <summary>{words.more}</summary>
      <div class="plan-row">
        <NumberField
          label={words.margin}
          value={pattern.margin_m}
          min={-10_000}
          max={10_000}
          set={(value) => surveys.set({ margin_m: value ?? 0 })}
        />
        <NumberField
          label={words.turnAround}
          value={pattern.turn_around_m}
          min={0}
          max={10_000}
          set={(value) => surveys.set({ turn_around_m: value ?? 0 })}
        />
        <label class="plan-field">
          {words.corner}
          <select
            value={String(pattern.corner)}
            onChange={({ currentTarget }) => surveys.set({ corner: Number(currentTarget.value) })}
          >
            {CORNERS.map((corner) => (
              <option key={corner} value={String(corner)}>
                {corner + 1}
              </option>
            ))}
          </select>
        </label>
      </div>
      <label class="survey-check">
        <input
          type="checkbox"
          checked={pattern.cross_hatch}
          onChange={({ currentTarget }) => surveys.set({ cross_hatch: currentTarget.checked })}
        />
        {words.crossHatch}
      </label>
      <fieldset class="survey-choices">
        <legend>{words.keepOut}</legend>
        {areas.length === 0 && <span>{words.noKeepOut}</span>}
        {areas.map(({ name }) => (
          <label key={name}>
            <input
              type="checkbox"
              checked={kept.has(name)}
              onChange={({ currentTarget }) => {
                const others = pattern.keep_out.filter((each) => each !== name);
                surveys.set({ keep_out: currentTarget.checked ? [...others, name] : others });
              }}
            />
            {name}
          </label>
        ))}
      </fieldset>
      {kept.size > 0 && (
        <NumberField
          label={words.clearance}
          value={pattern.clearance_m}
          min={0}
          max={10_000}
          set={(value) => surveys.set({ clearance_m: value ?? 0 })}
        />
      )}
    </details>
  );
}

function Vehicles({ surveys, pattern }: Part) {
  const all = surveys.vehicles.value;
  const chosen = new Set(pattern.vehicles);
  return (
    <>
      <fieldset class="survey-choices">
        <legend>{words.vehicles}</legend>
        {all.length === 0 && <span>{words.noVehicle}</span>}
        {all.map((id) => (
          <label key={id}>
            <input
              type="checkbox"
              checked={chosen.has(id)}
              onChange={({ currentTarget }) =>
                surveys.set({
                  vehicles: all.filter((each) =>
                    each === id ? currentTarget.checked : chosen.has(each),
                  ),
                })
              }
            />
            {id}
          </label>
        ))}
      </fieldset>
      <NumberField
        label={words.speed}
        value={pattern.speed_m_s}
        min={0.1}
        max={1000}
        optional
        placeholder={words.speedHint}
        set={(value) => surveys.set({ speed_m_s: value })}
      />
    </>
  );
}

interface NumbersProps {
  editor: EditorContext;
  pattern: Pattern;
  routes: SurveyRoutes;
}

/** What the survey takes, in all and of each vehicle. */
function Numbers({ editor, pattern, routes }: NumbersProps) {
  const { spacing_m, trigger_distance_m, ground_resolution_m, problems } = routes;
  const area = editor.plan.find(pattern.area);
  const sum = (of: (route: SurveyRoutes["routes"][number]) => number | null) =>
    routes.routes.reduce((total, each) => total + (of(each) ?? 0), 0);
  const images = sum((each) => each.images);
  const longest = Math.max(...routes.routes.map((each) => each.time_s ?? 0));
  const { sums } = words;
  const said = [
    area && fill(sums.area, { area: writtenArea(area_m2(draftOf(area).vertices)) }),
    fill(sums.passes, { count: sum((each) => each.passes), spacing: spacing_m.toFixed(1) }),
    fill(sums.length, { length: writtenLength(sum((each) => each.length_m)) }),
    trigger_distance_m !== null &&
      fill(sums.images, { count: images, distance: trigger_distance_m.toFixed(1) }),
    ground_resolution_m !== null &&
      fill(sums.resolution, { resolution: (ground_resolution_m * PERCENT).toFixed(1) }),
    longest > 0 && fill(sums.time, { time: clock(longest) }),
  ].filter(Boolean);
  return (
    <>
      <p class="plan-sizes survey-sums">{said.join(" · ")}</p>
      <div class="survey-table" tabIndex={0} role="group" aria-label={words.table}>
        <table aria-label={words.table}>
          <thead>
            <tr>
              {[words.vehicle, words.passes, words.length, words.time, words.images, words.battery].map(
                (each) => (
                  <th key={each} scope="col">
                    {each}
                  </th>
                ),
              )}
            </tr>
          </thead>
          <tbody>
            {routes.routes.map((each) => (
              <tr key={each.vehicle}>
                <th scope="row">{each.vehicle || words.anyVehicle}</th>
                <td>{each.passes}</td>
                <td>{writtenLength(each.length_m)}</td>
                <td>{each.time_s === null ? words.unknown : clock(each.time_s)}</td>
                <td>{each.images ?? "–"}</td>
                <td>
                  <Used fraction={each.battery_fraction} most={mostOf(each)} />
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {problems.map((each) => (
        <p key={each} class="plan-wrong" role="alert">
          {each}
        </p>
      ))}
    </>
  );
}

/** What part of a battery it may use. */
const mostOf = ({ lasts_s, time_s, battery_fraction }: SurveyRoutes["routes"][number]): number =>
  lasts_s && time_s && battery_fraction ? (lasts_s / time_s) * battery_fraction : 1;

function Used({ fraction, most }: { fraction: number | null; most: number }) {
  if (fraction === null) return <>{words.unknown}</>;
  const isTooMuch = fraction > most;
  return (
    <span class={`survey-used${isTooMuch ? " survey-much" : ""}`}>
      <meter min={0} max={1} high={most} value={Math.min(1, fraction)} aria-label={words.battery} />
      {fill(words.batteryUsed, { percent: Math.round(fraction * PERCENT) })}
    </span>
  );
}
