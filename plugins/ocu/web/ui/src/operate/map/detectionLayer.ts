// Detections on the map: a diamond each, with what was detected. The list of them is for the
// keyboard and screen readers.
import L from "leaflet";
import type { Detection } from "../../shared/types";
import { escaped } from "../../map/baseMap";

/** Older ones are in the list alone. */
const MOST_MARKS = 300;
/** Above the names of routes and areas. */
const ABOVE = 1000;
/** Nearer to a card, a mark is covered by it. */
const COVERED_PX = 16;
/** About the room that a text takes. */
const CHARACTER_PX = 8;
const MOST_TEXT_PX = 160;
const LINE_PX = 20;

interface Mark {
  marker: L.Marker;
  detection: Detection;
}

export class DetectionLayer {
  /** The newest last. */
  private readonly marks = new Map<number, Mark>();
  private readonly layer = L.layerGroup();
  private chosen: number | null = null;

  constructor(
    private readonly map: L.Map,
    private readonly listener: (number: number) => void,
  ) {
    this.layer.addTo(map);
    map.on("zoomend", () => this.dress());
  }

  /** Draw the newest of them. */
  show(detections: readonly Detection[]): void {
    const wanted = new Map(
      detections
        .filter(({ position }) => placeOf(position))
        .slice(-MOST_MARKS)
        .map((each) => [each.number, each]),
    );
    let changed = false;
    for (const [number, { marker, detection }] of this.marks) {
      if (isSame(wanted.get(number), detection)) continue;
      this.layer.removeLayer(marker);
      this.marks.delete(number);
      changed = true;
    }
    for (const [number, detection] of wanted) {
      if (this.marks.has(number)) continue;
      this.marks.set(number, { marker: this.add(detection), detection });
      changed = true;
    }
    if (changed) this.dress();
  }

  /** Of those that are drawn. */
  positions(): L.LatLng[] {
    return [...this.marks.values()].map(({ marker }) => marker.getLatLng());
  }

  /** Mark one, and have it in view. */
  choose(number: number | null): void {
    this.chosen = number;
    this.dress();
    const place = number === null ? undefined : this.marks.get(number)?.marker.getLatLng();
    if (place && !this.map.getBounds().pad(-0.1).contains(place)) {
      this.map.panTo(place, { animate: false });
    }
  }

  /** Have the chosen one beside or above a card that covers a part of the map. */
  clear(card: DOMRect): void {
    const mark = this.chosen === null ? undefined : this.marks.get(this.chosen)?.marker;
    if (!mark) return;
    const map = this.map.getContainer().getBoundingClientRect();
    const at = this.map.latLngToContainerPoint(mark.getLatLng());
    const [x, y] = [at.x + map.left, at.y + map.top];
    const isBeside = x < card.left - COVERED_PX || x > card.right + COVERED_PX;
    if (isBeside || y < card.top - COVERED_PX || y > card.bottom + COVERED_PX) return;
    const [beside, above] = [map.right - card.right, card.top - map.top];
    if (Math.max(beside, above) < COVERED_PX) return;
    const to =
      beside * map.height >= above * map.width
        ? L.point(map.width - beside / 2, map.height / 2)
        : L.point(map.width / 2, above / 2);
    this.map.panBy(at.subtract(to), { animate: false });
  }

  turn(on: boolean): void {
    if (on) this.layer.addTo(this.map);
    else this.layer.remove();
    this.dress();
  }

  private add({ number, type, position }: Detection): L.Marker {
    const icon = L.divIcon({
      className: "map-detection",
      html: `<i></i><span>${escaped(type)}</span>`,
      iconSize: [16, 16],
    });
    const marker = L.marker(placeOf(position)!, {
      icon,
      title: type,
      keyboard: false,
      zIndexOffset: ABOVE,
    });
    marker.on("click", () => this.listener(number));
    return marker.addTo(this.layer);
  }

  /**
   * Say which one is chosen. A text that would lie on that of a newer one is left out; never that
   * of the chosen one.
   */
  private dress(): void {
    const kept: L.Bounds[] = [];
    const newest = [...this.marks].reverse();
    const first = newest.filter(([number]) => number === this.chosen);
    const rest = newest.filter(([number]) => number !== this.chosen);
    for (const [number, { marker, detection }] of [...first, ...rest]) {
      const { classList } = marker.getElement() ?? {};
      if (!classList) continue; // marks are hidden
      classList.toggle("map-detection-chosen", number === this.chosen);
      const at = this.map.latLngToLayerPoint(marker.getLatLng());
      const width = Math.min(MOST_TEXT_PX, detection.type.length * CHARACTER_PX);
      const text = L.bounds(at, at.add([width + LINE_PX, LINE_PX]));
      const hasRoom = !kept.some((other) => other.overlaps(text));
      classList.toggle("map-detection-unnamed", !hasRoom);
      if (hasRoom) kept.push(text);
    }
  }
}

/** Whether its mark is as it was: a picture may have come. */
function isSame(now: Detection | undefined, { type, position }: Detection): boolean {
  return (
    now?.type === type &&
    now.position.latitude_deg === position.latitude_deg &&
    now.position.longitude_deg === position.longitude_deg
  );
}

function placeOf({ latitude_deg, longitude_deg }: Detection["position"]): L.LatLngTuple | null {
  return latitude_deg === null || longitude_deg === null ? null : [latitude_deg, longitude_deg];
}
