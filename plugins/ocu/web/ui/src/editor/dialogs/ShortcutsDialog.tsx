// What the keyboard does in the editor.
import { Dialog } from "../../shared/Dialog";
import { strings } from "../../strings";

const words = strings.editor.shortcuts;

type Key = keyof typeof words.keys;

const SHORTCUTS: Record<keyof typeof words.groups, [Key, string][]> = {
  file: [
    ["save", "Ctrl S"],
    ["help", "?"],
  ],
  edit: [
    ["undo", "Ctrl Z"],
    ["redo", "Ctrl Y"],
    ["copy", "Ctrl C, X, V"],
    ["duplicate", "Ctrl D"],
    ["all", "Ctrl A"],
    ["remove", "Delete"],
    ["move", "← ↑ → ↓"],
  ],
  draw: [
    ["create", "N"],
    ["append", "A"],
    ["replace", "R"],
    ["label", "E"],
    ["connect", "C"],
    ["lasso", "L"],
    ["space", "S"],
    ["hand", "H"],
  ],
  look: [
    ["find", "Ctrl F"],
    ["next", "Tab, Shift Tab"],
    ["zoom", "Ctrl + − 0"],
    ["fit", "Ctrl 9"],
  ],
};

export function ShortcutsDialog({ close }: { close(): void }) {
  return (
    <Dialog title={words.title} onClose={close} wide>
      <div class="m2-shortcuts">
        {Object.entries(SHORTCUTS).map(([group, keys]) => (
          <section key={group}>
            <h3>{words.groups[group as keyof typeof SHORTCUTS]}</h3>
            <dl>
              {keys.map(([key, pressed]) => (
                <div key={key}>
                  <dt>
                    <kbd>{pressed}</kbd>
                  </dt>
                  <dd>{words.keys[key]}</dd>
                </div>
              ))}
            </dl>
          </section>
        ))}
      </div>
    </Dialog>
  );
}
