// Pictures on buttons, 20 by 20, in the colour of the text.
const PATHS = {
  undo: "M8 4 3 9l5 5v-3h3a4 4 0 0 1 0 8h-1v2h1a6 6 0 0 0 0-12H8z",
  redo: "m12 4 5 5-5 5v-3H9a4 4 0 0 0 0 8h1v2H9A6 6 0 0 1 9 9h3z",
  search:
    "M9 3a6 6 0 0 1 4.700 9.700l3.800 3.800-1 1-3.800-3.800A6 6 0 1 1 9 3zm0 1.800a4.200 4.200 0 1 0 0 8.400 4.200 4.200 0 0 0 0-8.400z",
  plus: "M9 4h2v5h5v2h-5v5H9v-5H4V9h5z",
  minus: "M4 9h12v2H4z",
  fit: "M3 3h5v2H5v3H3zm9 0h5v5h-2V5h-3zM3 12h2v3h3v2H3zm12 0h2v5h-5v-2h3z",
  map: "M2 4h16v12H2zm2 2v8h12V6zm1 1h5v4H5z",
  place:
    "M10 2a6 6 0 0 1 6 6c0 4-6 10-6 10S4 12 4 8a6 6 0 0 1 6-6zm0 3.500a2.500 2.500 0 1 0 .01 0z",
  layout:
    "M3 3h5v4H3zm9 0h5v4h-5zM3 13h5v4H3zm9 0h5v4h-5zM8 4.500h4v1H8zm1.500 0h1V15h-1zM8 14.500h4v1H8z",
  blocks: "M3 3h6v6H3zm8 0h6v6h-6zM3 11h6v6H3zm8 0h6v6h-6z",
  panel: "M2 3h16v14H2zm2 2v10h7V5z",
  more: "M10 3a1.700 1.700 0 1 1 0 3.400A1.700 1.700 0 0 1 10 3zm0 5.300a1.700 1.700 0 1 1 0 3.400 1.700 1.700 0 0 1 0-3.400zm0 5.300a1.700 1.700 0 1 1 0 3.400 1.700 1.700 0 0 1 0-3.400z",
  back: "m9 4 1.400 1.400L6.800 9H17v2H6.800l3.600 3.600L9 16l-6-6z",
} as const;

export type IconName = keyof typeof PATHS;

export function Icon({ name }: { name: IconName }) {
  return (
    <svg viewBox="0 0 20 20" width="18" height="18" aria-hidden="true" focusable="false">
      <path d={PATHS[name]} fill="currentColor" fill-rule="evenodd" />
    </svg>
  );
}

export interface IconButtonProps {
  icon: IconName;
  label: string;
  act(): void;
  disabled?: boolean;
  pressed?: boolean;
}

export function IconButton({ icon, label, act, disabled, pressed }: IconButtonProps) {
  return (
    <button
      type="button"
      class="plain"
      title={label}
      aria-label={label}
      aria-pressed={pressed}
      disabled={disabled}
      onClick={act}
    >
      <Icon name={icon} />
    </button>
  );
}
