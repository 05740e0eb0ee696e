// The vehicles of a map for who cannot see it.
import type { ReadonlySignal } from "@preact/signals";
import { heading_deg } from "../shared/format";
import { fill, strings } from "../strings";
import type { Mark } from "./vehicleCanvas";

const text = strings.operate.map;

type Listed = Extract<Mark, { kind: "vehicle" }>;

export function VehicleList({ vehicles }: { vehicles: ReadonlySignal<readonly Listed[]> }) {
  if (vehicles.value.length === 0) return null;
  return (
    <ul class="for-readers" aria-label={text.vehicles}>
      {vehicles.value.map((mark) => (
        <li key={mark.vehicle.id}>{sentence(mark)}</li>
      ))}
    </ul>
  );
}

function sentence({ vehicle: { id, health, yaw_rad }, latitude, longitude }: Listed): string {
  return fill(yaw_rad === null ? text.vehicle : text.vehicleHeading, {
    name: id,
    health: strings.fleet.health[health],
    latitude: latitude.toFixed(6),
    longitude: longitude.toFixed(6),
    heading: yaw_rad === null ? "" : Math.round(heading_deg(yaw_rad)) % 360,
  });
}
