// Which names have room on a map, so that none lies on another.

const HEIGHT_PX = 14;
const CELL_PX = 64;

export interface Named {
  x: number;
  y: number;
  /** Of the text, in pixels. */
  width: number;
}

/** Those whose names have room, the first ones first. `y` is the top of a name, `x` its middle. */
export function roomFor<T extends Named>(all: readonly T[]): T[] {
  // Names are looked for only in the cells that they touch.
  const cells = new Map<string, T[]>();
  return all.filter((each) => {
    const touched = cellsOf(each);
    if (touched.some((cell) => cells.get(cell)?.some((other) => overlap(each, other)))) return false;
    for (const cell of touched) {
      const there = cells.get(cell);
      if (there) there.push(each);
      else cells.set(cell, [each]);
    }
    return true;
  });
}

function cellsOf({ x, y, width }: Named): string[] {
  const found: string[] = [];
  const index = (px: number) => Math.floor(px / CELL_PX);
  for (let column = index(x - width / 2); column <= index(x + width / 2); column += 1) {
    for (let row = index(y); row <= index(y + HEIGHT_PX); row += 1) found.push(`${column} ${row}`);
  }
  return found;
}

const overlap = (one: Named, other: Named): boolean =>
  Math.abs(one.x - other.x) < (one.width + other.width) / 2 &&
  Math.abs(one.y - other.y) < HEIGHT_PX;
