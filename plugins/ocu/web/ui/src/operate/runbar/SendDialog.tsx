// To send a signal or a message, by its name; those that are meant for operators come first.
import { useSignal } from "@preact/signals";
import { command } from "../../shared/command";
import { Dialog } from "../../shared/Dialog";
import { toast } from "../../shared/Toasts";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import type { Definition } from "../mission/missionModel";
import { dataOf } from "./data";

const text = strings.operate.signals;

export function SendDialog({ what, onClose }: { what: "signal" | "message"; onClose: () => void }) {
  const { scene, mission } = useOperating();
  const offered = what === "signal" ? mission.signals : mission.messages;
  const chosen = useSignal(offered[0]?.id ?? "");
  const data = useSignal("");
  const everywhere = useSignal(false);
  const parsed = dataOf(data.value);

  const send = async (event: Event) => {
    event.preventDefault();
    if (parsed === null || !chosen.value) return;
    const path =
      what === "signal" && everywhere.value
        ? "/signals"
        : `/runs/${encodeURIComponent(scene.run)}/${what}s`;
    const body = { [what]: what === "signal" ? nameOf(chosen.value) : chosen.value, data: parsed };
    if (!(await command(path, body))) return;
    toast(fill(text.sent, { name: mission.definition(chosen.value) }), "good");
    onClose();
  };

  // The drawing may have another id for it than the mission; a name says it as well.
  const nameOf = (id: string) => {
    const name = mission.definition(id);
    return offered.filter((other) => other.name === name).length === 1 ? name : id;
  };

  return (
    <Dialog
      title={what === "signal" ? text.title : text.messageTitle}
      onClose={onClose}
      actions={
        <button class="primary" form="send" disabled={!chosen.value || parsed === null}>
          {text.send}
        </button>
      }
    >
      {offered.length === 0 ? (
        <p>{text.none}</p>
      ) : (
        <form id="send" class="form" onSubmit={(event) => void send(event)}>
          <label>
            {what === "signal" ? text.name : text.message}
            <select
              value={chosen.value}
              onChange={(event) => (chosen.value = event.currentTarget.value)}
            >
              <Options title={text.operators} offered={offered.filter((each) => each.operators)} />
              <Options title={text.others} offered={offered.filter((each) => !each.operators)} />
            </select>
          </label>
          <label>
            {text.data}
            <textarea
              rows={3}
              spellcheck={false}
              placeholder="{}"
              value={data.value}
              aria-invalid={parsed === null}
              onInput={(event) => (data.value = event.currentTarget.value)}
            />
          </label>
          <p role="alert" class="problem">
            {parsed === null && text.dataWrong}
          </p>
          {what === "signal" && (
            <label class="switch">
              <input
                type="checkbox"
                checked={everywhere.value}
                onChange={(event) => (everywhere.value = event.currentTarget.checked)}
              />
              {text.allRuns}
            </label>
          )}
        </form>
      )}
    </Dialog>
  );
}

function Options({ title, offered }: { title: string; offered: readonly Definition[] }) {
  if (offered.length === 0) return null;
  return (
    <optgroup label={title}>
      {offered.map(({ id, name }) => (
        <option key={id} value={id}>
          {name}
        </option>
      ))}
    </optgroup>
  );
}
