// What the cameras of a vehicle see, or a camera itself, once that is asked for.
import { signal } from "@preact/signals";
import { loaded } from "../shared/loaded";
import type { Fleet } from "../shared/types";
import { strings } from "../strings";

const CameraList = loaded(() => import("../operate/cameras/CameraList"));

/** Whether they are shown, of whichever vehicle is chosen. */
const areShown = signal(false);

export function VehicleCameras({ fleet, resource }: { fleet: Fleet; resource: string }) {
  const cameras = fleet.payloads.filter(
    ({ id, vehicle, video }) => video && (id === resource || vehicle === resource),
  );
  if (cameras.length === 0) return null;
  return (
    <div class="fleet-cameras">
      <button
        type="button"
        class="secondary"
        aria-expanded={areShown.value}
        onClick={() => (areShown.value = !areShown.value)}
      >
        {areShown.value ? strings.fleet.hideCameras : strings.fleet.showCameras}
      </button>
      {areShown.value && <CameraList payloads={cameras} />}
    </div>
  );
}
