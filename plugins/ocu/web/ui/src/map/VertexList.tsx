// The vertices of a drawing as numbers: what the mouse does on the map, the keyboard does here.
import { fill, strings } from "../strings";
import type { Vertex } from "./draft";

const text = strings.operate.map;

export interface VertexListProps {
  vertices: readonly Vertex[];
  move(index: number, to: Partial<Vertex>): void;
  remove(index: number): void;
}

export function VertexList({ vertices, move, remove }: VertexListProps) {
  return (
    <ol class="draw-vertices">
      {vertices.map((vertex, index) => (
        <li key={index}>
          <VertexFields
            vertex={vertex}
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
  label: string;
  onChange: (to: Partial<Vertex>) => void;
}

function VertexFields({ vertex, label, onChange }: VertexFieldsProps) {
  const number = (
    name: string,
    value: number | null,
    limit: number,
    set: (value: number | null) => void,
  ) => (
    <input
      type="number"
      step="any"
      min={-limit}
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
    </>
  );
}
