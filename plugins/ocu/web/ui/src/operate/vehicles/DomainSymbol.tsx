// One symbol for each domain, pointing up; the map uses the same.
import type { Fleet } from "../../shared/types";

type Domain = Fleet["vehicles"][number]["domain"];

/** Paths in a box of 24 by 24, the bow at the top. */
export const DOMAIN_PATHS: Record<Domain, string> = {
  ground: "M12 1l5 6v14a2 2 0 0 1-2 2H9a2 2 0 0 1-2-2V7z",
  air: "M12 1l2.2 6.5L23 13v2.6l-8.8-2.2-.5 5 3.3 2.4V23L12 21.6 7 23v-2.2l3.3-2.4-.5-5L1 15.6V13l8.8-5.5z",
  surface: "M12 1c4 4.5 6 9 6 14v6l-6 2-6-2v-6c0-5 2-9.5 6-14z",
  subsurface:
    "M12 1c3 0 4.5 3.5 4.5 7v9c0 3-1 5-2.5 5.5h-4C8.5 22 7.5 20 7.5 17V8c0-3.5 1.5-7 4.5-7zM3 17h18v3H3z",
};

export function DomainSymbol({ domain }: { domain: Domain }) {
  return (
    <svg
      class={`domain domain-${domain}`}
      viewBox="0 0 24 24"
      width="20"
      height="20"
      aria-hidden="true"
    >
      <path d={DOMAIN_PATHS[domain]} />
    </svg>
  );
}
