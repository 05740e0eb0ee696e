// The vertices of a drawing as numbers: what the mouse does on the map, the keyboard does here.
import { fill, strings } from "../strings";
import type { Vertex } from "./draft";

const text = strings.operate.map;

export interface VertexListProps {
  vertices: readonly Vertex[];
  /** Whether vertices have speeds: those of routes. */
  hasSpeeds: boolean;
  move(index: number, to: Partial<Vertex>): void;
  remove(index: number): void;
}

export function VertexList({ vertices, hasSpeeds, move, remove }: VertexListProps) {
  return (
    <ol class="draw-vertices">
      {vertices.map((vertex, index) => (
        <li key={index}>
          <VertexFields
            vertex={vertex}
            hasSpeed={hasSpeeds}
            label={fill(text.vertex, { number: index + 1 })}
            onChange={(to) => move(index, to)}
          />
          <button
            type="button"
            class="plain"
            aria-label={fill(text.removeVertex, { number: index + 1 })}
            onClick={() => remove(index)}
          >
            ×
          </button>
        </li>
      ))}
    </ol>
  );
}

interface VertexFieldsProps {
  vertex: Vertex;
  hasSpeed: boolean;
  label: string;
  onChange: (to: Partial<Vertex>) => void;
}

function VertexFields({ vertex, hasSpeed, label, onChange }: VertexFieldsProps) {
  const number = (
    name: string,
    value: number | null,
    limit: number,
    set: (value: number | null) => void,
    least = -limit,
  ) => (
    <input
      type="number"
      step="any"
      min={least}
      max={limit}
      aria-label={`${label}: ${name}`}
      placeholder={name}
      value={value ?? ""}
      onChange={({ currentTarget: { value: typed, valueAsNumber, validity } }) => {
        if (typed === "") set(null);
        else if (validity.valid) set(valueAsNumber);
      }}
    />
  );
  return (
    <>
      {number(text.latitude, Number(vertex.latitude.toFixed(7)), 90, (latitude) => {
        if (latitude !== null) onChange({ latitude });
      })}
      {number(text.longitude, Number(vertex.longitude.toFixed(7)), 180, (longitude) => {
        if (longitude !== null) onChange({ longitude });
      })}
      {number(text.altitude, vertex.altitude, 20_000, (altitude) => onChange({ altitude }))}
      {hasSpeed &&
        number(text.speed, vertex.speed ?? null, 100, (speed) => onChange({ speed }), 0.1)}
    </>
  );
}
