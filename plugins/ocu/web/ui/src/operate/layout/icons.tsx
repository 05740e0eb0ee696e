// Pictures on buttons, 20 by 20, in the colour of the text.
const PATHS = {
  play: "M5 3v14l12-7z",
  pause: "M5 3h4v14H5zM11 3h4v14h-4z",
  back: "M13 4v12l-8-6zM3 4h2v12H3z",
  forward: "M7 4v12l8-6zM15 4h2v12h-2z",
  start: "M10 4v12l-6-6zM17 4v12l-6-6zM2 4h2v12H2z",
  end: "M10 4v12l6-6zM3 4v12l6-6zM16 4h2v12h-2z",
} as const;

export function Icon({ name }: { name: keyof typeof PATHS }) {
  return (
    <svg viewBox="0 0 20 20" width="16" height="16" aria-hidden="true">
      <path d={PATHS[name]} fill="currentColor" />
    </svg>
  );
}
