// Lines of latitude and longitude, so that a map without tiles has a measure.
import L from "leaflet";

const LEAST_PX = 110;
const STEPS = [1, 2, 5];

/** Degrees between lines: 1, 2 or 5 times a power of ten, and how many decimals that takes. */
export function stepFor(degrees_per_px: number): { step: number; decimals: number } {
  const least = degrees_per_px * LEAST_PX;
  for (let power = -7; power <= 2; power += 1) {
    for (const digit of STEPS) {
      const step = digit * 10 ** power;
      if (step >= least) return { step, decimals: Math.max(0, -power) };
    }
  }
  return { step: 90, decimals: 0 };
}

export class Graticule {
  private readonly layer = L.layerGroup();

  constructor(private readonly map: L.Map) {
    this.layer.addTo(map);
    map.on("moveend resize", () => this.draw());
    this.draw();
  }

  private draw(): void {
    const { map, layer } = this;
    layer.clearLayers();
    const size = map.getSize();
    if (size.x === 0) return;
    const bounds = map.getBounds();
    const { step, decimals } = stepFor((bounds.getEast() - bounds.getWest()) / size.x);
    const [south, north] = [Math.max(-85, bounds.getSouth()), Math.min(85, bounds.getNorth())];
    const [west, east] = [bounds.getWest(), bounds.getEast()];
    for (let index = Math.ceil(south / step); index * step <= north; index += 1) {
      const latitude = index * step;
      this.line([latitude, west], [latitude, east]);
      this.label([latitude, west], `${latitude.toFixed(decimals)}°`, "graticule-latitude");
    }
    for (let index = Math.ceil(west / step); index * step <= east; index += 1) {
      const longitude = index * step;
      this.line([south, longitude], [north, longitude]);
      this.label([north, longitude], `${longitude.toFixed(decimals)}°`, "graticule-longitude");
    }
  }

  private line(from: L.LatLngTuple, to: L.LatLngTuple): void {
    const style = { color: "#8b98a5", weight: 1, opacity: 0.35, interactive: false };
    L.polyline([from, to], style).addTo(this.layer);
  }

  private label(at: L.LatLngTuple, text: string, className: string): void {
    const icon = L.divIcon({
      className: `graticule ${className}`,
      html: text,
      iconSize: undefined,
    });
    L.marker(at, { icon, interactive: false, keyboard: false }).addTo(this.layer);
  }
}
