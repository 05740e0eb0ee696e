// A canvas in a pane of a map. It is drawn when the browser is about to paint, however often it is asked
// for, and scaled while the map zooms.
import L from "leaflet";
import { zoomWith } from "./zoomWith";

export abstract class MapCanvas extends L.Layer {
  protected map: L.Map | null = null;
  private canvas: HTMLCanvasElement | null = null;
  private wanted = 0;
  private isZooming = false;

  constructor(
    private readonly pane: "overlayPane" | "markerPane",
    private readonly name: string,
  ) {
    super();
  }

  override onAdd(map: L.Map): this {
    this.map = map;
    const names = `${this.name} leaflet-zoom-animated`;
    this.canvas = L.DomUtil.create("canvas", names, map.getPanes()[this.pane]);
    map.on("move zoom resize", this.moved, this);
    map.on("viewreset", this.reset, this);
    map.on("zoomanim", this.animate, this);
    map.on("zoomend", this.settle, this);
    this.reset();
    return this;
  }

  override onRemove(map: L.Map): this {
    map.off("move zoom resize", this.moved, this);
    map.off("viewreset", this.reset, this);
    map.off("zoomanim", this.animate, this);
    map.off("zoomend", this.settle, this);
    cancelAnimationFrame(this.wanted);
    this.wanted = 0;
    this.canvas?.remove();
    this.canvas = null;
    this.map = null;
    return this;
  }

  /** Draw before the browser's next picture. */
  protected ask(): void {
    if (!this.map) return;
    this.wanted ||= requestAnimationFrame(() => {
      this.wanted = 0;
      const context = this.canvas?.getContext("2d");
      if (this.map && context && !this.isZooming) this.draw(this.map, context);
    });
  }

  /** The map shows another place, or is of another size. */
  protected abstract moved(): void;

  /** What was drawn is of no use any more. */
  protected abstract reset(): void;

  protected abstract draw(map: L.Map, context: CanvasRenderingContext2D): void;

  /**
   * Put the canvas at `corner`, in the pixels of the map's layers, in this size. Its context draws in
   * pixels of the page; returns how many of the screen each has.
   */
  protected lay(context: CanvasRenderingContext2D, corner: L.Point, size: L.Point): number {
    const { canvas } = context;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(size.x * ratio), Math.round(size.y * ratio)];
    if (canvas.width !== width || canvas.height !== height) {
      [canvas.width, canvas.height] = [width, height];
      [canvas.style.width, canvas.style.height] = [`${size.x}px`, `${size.y}px`];
    }
    L.DomUtil.setPosition(canvas, corner);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return ratio;
  }

  private animate({ center, zoom }: L.ZoomAnimEvent): void {
    if (!this.map || !this.canvas) return;
    this.isZooming = true;
    zoomWith(this.map, this.canvas, center, zoom);
  }

  private settle(): void {
    this.isZooming = false;
    this.reset();
  }
}
