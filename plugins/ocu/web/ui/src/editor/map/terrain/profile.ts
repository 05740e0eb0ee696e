// The ground along a route, as the server says it, and its picture's geometry.
export interface ProfilePoint {
  along_m: number;
  latitude_deg: number;
  longitude_deg: number;
  ground_m: number | null;
  altitude_m: number | null;
  above_ground_m: number | null;
  waypoint: number | null;
}

export interface Profile {
  points: ProfilePoint[];
  lowest: number | null;
  clearance_m: number | null;
  missing: string;
}

export interface Plot {
  /** Of the ground, down to the lower edge. */
  ground: string;
  route: string;
  /** Pieces of the route that are too low. */
  low: string[];
  waypoints: [x: number, y: number][];
  /** Lowest and highest altitude, m above mean sea level. */
  range_m: [low: number, high: number];
}

const MARGIN = 0.08;

/** In a picture of a width and a height; null: nothing is known. */
export function plotOf({ points, clearance_m }: Profile, width: number, height: number): Plot | null {
  const known = points.flatMap(({ ground_m, altitude_m }) => [ground_m, altitude_m]);
  const levels = known.filter((each): each is number => each !== null);
  const length = points.at(-1)?.along_m ?? 0;
  if (levels.length === 0) return null;
  const [least, most] = [Math.min(...levels), Math.max(...levels)];
  const span = Math.max(most - least, 10);
  const [low, high] = [least - span * MARGIN, least + span * (1 + MARGIN)];
  const x = (along_m: number) => (length > 0 ? (along_m / length) * width : 0);
  const y = (level_m: number) => height - ((level_m - low) / (high - low)) * height;
  const place = (along_m: number, level_m: number) => `${x(along_m).toFixed(1)},${y(level_m).toFixed(1)}`;
  const ground = points.flatMap(({ along_m, ground_m }) =>
    ground_m === null ? [] : [place(along_m, ground_m)],
  );
  const first = points.find(({ ground_m }) => ground_m !== null);
  const last = points.findLast(({ ground_m }) => ground_m !== null);
  const flown = points.flatMap(({ along_m, altitude_m }) =>
    altitude_m === null ? [] : [place(along_m, altitude_m)],
  );
  const isLow = ({ above_ground_m }: ProfilePoint) =>
    above_ground_m !== null && above_ground_m < (clearance_m ?? 0);
  const pieces: string[] = [];
  points.forEach((each, index) => {
    const next = points[index + 1];
    if (!next || each.altitude_m === null || next.altitude_m === null) return;
    if (!isLow(each) && !isLow(next)) return;
    pieces.push(`${place(each.along_m, each.altitude_m)} ${place(next.along_m, next.altitude_m)}`);
  });
  return {
    ground:
      first && last
        ? `${x(first.along_m).toFixed(1)},${height} ${ground.join(" ")} ${x(last.along_m).toFixed(1)},${height}`
        : "",
    route: flown.join(" "),
    low: pieces,
    waypoints: points.flatMap(({ waypoint, along_m, altitude_m }): [number, number][] =>
      waypoint === null || altitude_m === null ? [] : [[x(along_m), y(altitude_m)]],
    ),
    range_m: [least, most],
  };
}
