// The moment that is shown, in the address of the page: to come back to it, or to show it to
// others.

/** Seconds, of `?t=`; null: none is named. */
export function positionInAddress(): number | null {
  const said = new URLSearchParams(location.search).get("t");
  const t = said === null ? NaN : Number(said);
  return Number.isFinite(t) ? t : null;
}

export function keepPosition(t: number): void {
  const search = new URLSearchParams(location.search);
  search.set("t", t.toFixed(1));
  history.replaceState(history.state, "", `${location.pathname}?${search}`);
}
