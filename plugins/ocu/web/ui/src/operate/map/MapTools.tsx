// What the map shows, whom it follows, and what is drawn on it.
import type { Signal } from "@preact/signals";
import { Menu } from "../../shared/Menu";
import { fill, strings } from "../../strings";
import type { Fleet, Geometry } from "../../shared/types";
import type { Kind } from "../../map/draft";

const text = strings.operate.map;

export interface MapShows {
  trails: boolean;
  names: boolean;
  footprints: boolean;
  detections: boolean;
  geometries: boolean;
}

export interface MapToolsProps {
  fleet: Fleet;
  followed: Signal<string>;
  shows: Signal<MapShows>;
  geometries: readonly Geometry[];
  mayDraw: boolean;
  onFit: () => void;
  onDraw: (kind: Kind) => void;
  onEdit: (geometry: Geometry) => void;
  onVersions: (name: string) => void;
}

const DRAWN: [Kind, string][] = [
  ["route", text.drawRoute],
  ["area", text.drawArea],
  ["point", text.drawPoint],
];

const SHOWN = ["trails", "names", "footprints", "detections", "geometries"] as const;

export function MapTools(props: MapToolsProps) {
  const { fleet, followed, shows, geometries, mayDraw, onFit, onDraw, onEdit, onVersions } = props;
  return (
    <div class="tools">
      <select
        aria-label={text.follow}
        value={followed.value}
        onChange={(event) => (followed.value = event.currentTarget.value)}
      >
        <option value="">{text.followNobody}</option>
        {fleet.vehicles.map(({ id }) => (
          <option key={id} value={id}>
            {text.follow} {id}
          </option>
        ))}
      </select>
      <details class="folder" onKeyDown={closeOnEscape}>
        <summary>{text.show}</summary>
        <div>
          {SHOWN.map((name) => (
            <label key={name} class="switch">
              <input
                type="checkbox"
                checked={shows.value[name]}
                onChange={(event) => {
                  shows.value = { ...shows.value, [name]: event.currentTarget.checked };
                }}
              />
              {text[name]}
            </label>
          ))}
        </div>
      </details>
      <Menu
        label={text.draw}
        class="plain"
        items={[
          ...DRAWN.map(([kind, label]) => ({
            label,
            disabled: !mayDraw,
            act: () => onDraw(kind),
          })),
          ...geometries.map((geometry) => ({
            label: `${text.edit} ${geometry.name}`,
            disabled: !mayDraw,
            act: () => onEdit(geometry),
          })),
          ...geometries
            .filter(({ from }) => from !== "mission")
            .map(({ name }) => ({
              label: fill(text.versions.open, { name }),
              act: () => onVersions(name),
            })),
        ]}
      >
        {text.draw} ▾
      </Menu>
      <button type="button" class="plain" onClick={onFit}>
        {text.fitAll}
      </button>
    </div>
  );
}

function closeOnEscape(event: KeyboardEvent & { currentTarget: HTMLDetailsElement }): void {
  if (event.key !== "Escape" || event.shiftKey || !event.currentTarget.open) return;
  event.stopPropagation();
  event.currentTarget.open = false;
  event.currentTarget.querySelector("summary")?.focus();
}
