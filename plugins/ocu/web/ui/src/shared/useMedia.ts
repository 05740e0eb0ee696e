// Whether a media query holds, such as the width of the page.
import { useEffect, useState } from "preact/hooks";

export function useMedia(query: string): boolean {
  const [matches, setMatches] = useState(() => matchMedia(query).matches);
  useEffect(() => {
    const media = matchMedia(query);
    const renew = () => setMatches(media.matches);
    media.addEventListener("change", renew);
    return () => media.removeEventListener("change", renew);
  }, [query]);
  return matches;
}
