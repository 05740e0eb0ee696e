// The settings of this browser: colours, text size, size of the controls, language.
import { useState } from "preact/hooks";
import { Dialog } from "../shared/Dialog";
import { remember } from "../shared/memory";
import {
  chooseControls,
  chooseTextSize,
  CONTROLS,
  controls,
  TEXT_SIZES,
  textSize,
} from "../shared/settings";
import { stops } from "../shared/stopping";
import { chooseTheme, chosenTheme, THEMES } from "../shared/theme";
import { useUniqueId } from "../shared/uniqueId";
import { fill, strings } from "../strings";
import { chosenLanguage, LANGUAGES, type Language } from "../strings/language";
import "./settings.css";

const text = strings.settings;

export default function SettingsDialog({ onClose }: { onClose: () => void }) {
  return (
    <Dialog
      title={text.title}
      onClose={onClose}
      actions={
        <button type="button" class="primary" onClick={onClose}>
          {text.done}
        </button>
      }
    >
      <p class="settings-note">{text.hint}</p>
      <Choice
        title={text.theme}
        options={[null, ...THEMES]}
        chosen={chosenTheme.value}
        nameOf={(each) => text.themes[each ?? "system"]}
        choose={chooseTheme}
      />
      <Choice
        title={text.textSize}
        note={text.textSizeHint}
        options={TEXT_SIZES}
        chosen={textSize.value}
        nameOf={(each) => fill(text.percent, { percent: each })}
        choose={chooseTextSize}
      />
      <Choice
        title={text.controls}
        note={text.controlsHint}
        options={CONTROLS}
        chosen={controls.value}
        nameOf={(each) => text.controlSizes[each]}
        choose={chooseControls}
      />
      <LanguageChoice />
    </Dialog>
  );
}

interface ChoiceProps<T> {
  title: string;
  note?: string;
  options: readonly T[];
  chosen: T;
  nameOf: (option: T) => string;
  choose: (option: T) => void;
}

function Choice<T>({ title, note, options, chosen, nameOf, choose }: ChoiceProps<T>) {
  const id = useUniqueId();
  return (
    <fieldset class="settings-choice" aria-describedby={note ? `${id}-note` : undefined}>
      <legend>{title}</legend>
      <div class="settings-options">
        {options.map((option) => (
          <label key={String(option)}>
            <input
              type="radio"
              name={id}
              checked={option === chosen}
              onChange={() => choose(option)}
            />
            {nameOf(option)}
          </label>
        ))}
      </div>
      {note && (
        <p id={`${id}-note`} class="settings-note">
          {note}
        </p>
      )}
    </fieldset>
  );
}

const LANGUAGE_TAGS = Object.keys(LANGUAGES) as Language[];

/** Another language needs the page to be loaded again, which must not take a STOP along. */
function LanguageChoice() {
  const [before] = useState(chosenLanguage);
  const [chosen, setChosen] = useState(before);
  const waits = stops.value.some(({ state }) => state !== "refused");
  return (
    <>
      <Choice
        title={text.language}
        note={text.languageHint}
        options={[null, ...LANGUAGE_TAGS]}
        chosen={chosen}
        nameOf={(each) => (each === null ? text.browserLanguage : LANGUAGES[each])}
        choose={(each) => {
          setChosen(each);
          remember("language", each);
        }}
      />
      {chosen !== before && (
        <p class="settings-reload" role="status">
          <span>{waits ? text.reloadWaits : text.reloadHint}</span>
          <button
            type="button"
            class="secondary"
            disabled={waits}
            onClick={() => location.reload()}
          >
            {text.reload}
          </button>
        </p>
      )}
    </>
  );
}
