// Asks for the name of a mission, which is the name of a file too.
import { strings } from "../strings";
import { isName } from "./files";
import "./names.css";

const words = strings.home.newDialog;

export function nameProblem(name: string, taken: readonly string[]): string {
  const said = name.trim();
  if (!isName(said)) return words.badName;
  return taken.includes(said) ? words.taken : "";
}

interface NameInputProps {
  label: string;
  name: string;
  wrong: string;
  write(name: string): void;
}

export function NameInput({ label, name, wrong, write }: NameInputProps) {
  return (
    <label class="name-input">
      {label}
      <input
        value={name}
        maxLength={100}
        aria-invalid={wrong !== "" && name !== "" ? "true" : undefined}
        aria-describedby="name-note"
        onInput={(event) => write(event.currentTarget.value)}
      />
      <span id="name-note" class={wrong && name ? "name-note name-wrong" : "name-note"}>
        {name && wrong ? wrong : words.nameHint}
      </span>
    </label>
  );
}
