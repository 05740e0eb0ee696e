// The key of this browser's session. Browsers send the cookie to servers at other ports of the host
// as well; what is stored, they give to this origin alone, which has the port.
import { remember, remembered } from "./memory";

/** Where nothing may be stored, until the page is loaded again. */
let latest = "";

export const sessionKey = (): string => remembered("key", latest);

export function keepKey(key: string): void {
  latest = key;
  remember("key", key);
}
