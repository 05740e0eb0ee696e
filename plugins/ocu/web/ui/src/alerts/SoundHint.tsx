// Which alerts sound, and that none can yet: browsers keep a page silent until a click or a key.
import { fill, strings } from "../strings";
import { settings } from "./alerts";
import { maySound } from "./outputs";

const words = strings.alerts;

/** `isBrief`: only that nothing can sound, where the setting itself is beside it. */
export function SoundHint({ isBrief = false }: { isBrief?: boolean }) {
  const { sound } = settings.value;
  const isSilent = !maySound.value && sound !== "off";
  return (
    <p class="alert-hint">
      {!isBrief && `${fill(words.sounds, { which: words.soundFrom[sound] })} `}
      {/* It keeps its room: the click that lets the page sound must not miss what is clicked. */}
      <span class={isSilent ? undefined : "alert-unneeded"}>{words.silent}</span>
    </p>
  );
}
