// How the diagram is looked at.
import type { Signal } from "@preact/signals";
import { remember } from "../../shared/memory";
import { strings } from "../../strings";
import { chooseFade, choosePalette, fade_s, paletteName, type PaletteName } from "./colours";

const text = strings.operate.diagram;

const FADES = Object.keys(text.fades) as (keyof typeof text.fades)[];

export interface DiagramToolsProps {
  following: Signal<boolean>;
  several: boolean;
  onZoom: (factor: number) => void;
  onFit: () => void;
}

export function DiagramTools({ following, several, onZoom, onFit }: DiagramToolsProps) {
  return (
    <div class="tools">
      {several && (
        <label class="switch">
          <input
            type="checkbox"
            role="switch"
            checked={following.value}
            onChange={(event) => {
              following.value = event.currentTarget.checked;
              remember("follow", following.value);
            }}
          />
          {text.follow}
        </label>
      )}
      <label>
        <span>{text.palette}</span>
        <select
          value={paletteName.value}
          onChange={(event) => choosePalette(event.currentTarget.value as PaletteName)}
        >
          {Object.entries(text.palettes).map(([name, title]) => (
            <option key={name} value={name}>
              {title}
            </option>
          ))}
        </select>
      </label>
      <label>
        <span>{text.fade}</span>
        <select
          value={String(fade_s.value)}
          onChange={(event) => chooseFade(Number(event.currentTarget.value))}
        >
          {FADES.map((seconds) => (
            <option key={seconds} value={seconds}>
              {text.fades[seconds]}
            </option>
          ))}
        </select>
      </label>
      <button type="button" class="plain" aria-label={text.zoomOut} onClick={() => onZoom(1 / 1.3)}>
        −
      </button>
      <button type="button" class="plain" aria-label={text.zoomIn} onClick={() => onZoom(1.3)}>
        +
      </button>
      <button type="button" class="plain" onClick={onFit}>
        {text.fit}
      </button>
    </div>
  );
}
