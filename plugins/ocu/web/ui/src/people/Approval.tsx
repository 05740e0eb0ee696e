// Who has approved the mission, who must, and what has changed since an earlier approval.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { comparing } from "../compare/comparing";
import { get } from "../shared/api";
import { command } from "../shared/command";
import { may, session } from "../shared/session";
import { toast } from "../shared/Toasts";
import { counted, fill, strings } from "../strings";
import "./people.css";
import { moment } from "../shared/moments";

const words = strings.people.approval;
const AGAIN_MS = 5000;

interface Given {
  by: string;
  at_us: number;
}

interface State {
  digest: string;
  persons: number;
  missing: number;
  who: string;
  editors: string[];
  approvals: Given[];
  not_counted: Given[];
  earlier: (Given & { changed: string[]; version: number | null })[];
}

export function Approval({ mission, isDirty }: { mission: string; isDirty: boolean }) {
  const state = useSignal<State | null>(null);
  const path = `/missions/${encodeURIComponent(mission)}/approval`;
  const load = async () => {
    try {
      state.value = await get<State>(path);
    } catch {
      state.value = null; // it is not saved yet
    }
  };
  useEffect(() => {
    void load();
    const timer = setInterval(() => void load(), AGAIN_MS);
    return () => clearInterval(timer);
  }, [path, isDirty]);
  const now = state.value;
  if (!now || now.persons === 0) return null;
  const user = session.value?.user ?? "";
  const own = [...now.approvals, ...now.not_counted].some(({ by }) => by === user);
  const edited = now.editors.includes(user);
  const approve = async () => {
    if (await command(path, { digest: now.digest })) toast(words.done, "good");
    await load();
  };
  const withdraw = async () => {
    await command(`${path}/withdraw`);
    await load();
  };
  return (
    <section class="m2r-part approval" aria-label={words.title}>
      <h2>{words.title}</h2>
      <p class="m2-field-hint">
        {fill(words.hint, { persons: counted(words.persons, now.persons) })}
      </p>
      <p role="status">
        <strong>{now.missing === 0 ? words.approved : fill(words.missing, { who: now.who })}</strong>{" "}
        <small title={now.digest}>{fill(words.content, { digest: now.digest.slice(0, 8) })}</small>
      </p>
      <ul>
        {now.approvals.map(({ by, at_us }) => (
          <li key={by}>{fill(words.by, { by, when: when(at_us) })}</li>
        ))}
        {now.not_counted.map(({ by }) => (
          <li key={by}>{fill(words.notCounted, { by })}</li>
        ))}
        {now.earlier.map(({ by, at_us, changed, version }) => (
          <li key={`${by} ${at_us}`}>
            {fill(words.earlier, { by, when: when(at_us), changed: changed.join(", ") })}{" "}
            {version !== null && (
              <button
                type="button"
                class="secondary"
                onClick={() => (comparing.value = { before: version, after: "drawn" })}
              >
                {strings.compare.since}
              </button>
            )}
          </li>
        ))}
      </ul>
      {isDirty ? (
        <p class="m2-note">{words.unsaved}</p>
      ) : edited ? (
        <p class="m2-note">{words.own}</p>
      ) : (
        may("operator") && (
          <div class="m2v-actions">
            <button
              type="button"
              class="secondary"
              onClick={() => void (own ? withdraw() : approve())}
            >
              {own ? words.withdraw : words.approve}
            </button>
          </div>
        )
      )}
    </section>
  );
}

const when = (at_us: number): string =>
  moment(at_us / 1000);
