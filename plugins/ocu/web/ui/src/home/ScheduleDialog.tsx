// A mission of the folder, and when it starts.
import { useEffect, useState } from "preact/hooks";
import { get, post } from "../shared/api";
import { Dialog } from "../shared/Dialog";
import { attempt } from "../shared/Toasts";
import type { MissionLine } from "../shared/types";
import { fill, strings } from "../strings";

const words = strings.home.schedule.dialog;
const ZONE = Intl.DateTimeFormat().resolvedOptions().timeZone;

type Kind = "free" | "at" | "cron";
const KINDS: readonly Kind[] = ["free", "at", "cron"];

export function ScheduleDialog({ close }: { close(): void }) {
  const [missions, setMissions] = useState<readonly MissionLine[]>([]);
  const [mission, setMission] = useState("");
  const [kind, setKind] = useState<Kind>("at");
  const [time, setTime] = useState("");
  const [cron, setCron] = useState("");
  const [priority, setPriority] = useState("0");
  const [isSending, setSending] = useState(false);
  useEffect(() => {
    void get<MissionLine[]>("/missions").then((found) => {
      setMissions(found);
      setMission(found[0]?.name ?? "");
    });
  }, []);
  const isWhole =
    mission !== "" && (kind === "free" || (kind === "at" ? time !== "" : cron.trim() !== ""));

  const submit = async () => {
    if (!isWhole || isSending) return;
    setSending(true);
    const when =
      kind === "free" ? {} : { time_zone: ZONE, ...(kind === "at" ? { at: time } : { cron }) };
    const sent = { mission, when, priority: Number(priority) || 0 };
    const done = await attempt(() => post("/schedule", sent));
    setSending(false);
    if (done) close();
  };
  return (
    <Dialog
      title={words.title}
      onClose={close}
      actions={
        <>
          <button type="button" class="secondary" onClick={close}>
            {strings.home.cancel}
          </button>
          <button
            type="submit"
            form="schedule-mission"
            class="primary"
            disabled={!isWhole || isSending}
          >
            {words.submit}
          </button>
        </>
      }
    >
      <form
        id="schedule-mission"
        class="home-form"
        onSubmit={(event) => {
          event.preventDefault();
          void submit();
        }}
      >
        <label>
          {words.mission}
          <select value={mission} onChange={(event) => setMission(event.currentTarget.value)}>
            {missions.map(({ name }) => (
              <option key={name} value={name}>
                {name}
              </option>
            ))}
          </select>
        </label>
        <fieldset class="home-kinds">
          <legend>{words.start}</legend>
          {KINDS.map((each) => (
            <label key={each}>
              <input
                type="radio"
                name="kind"
                checked={kind === each}
                onChange={() => setKind(each)}
              />
              {words[each]}
            </label>
          ))}
        </fieldset>
        {kind === "at" && (
          <label>
            {words.time}
            <input
              type="datetime-local"
              step={1}
              value={time}
              onInput={(event) => setTime(event.currentTarget.value)}
            />
          </label>
        )}
        {kind === "cron" && (
          <label>
            {words.cronText}
            <input
              type="text"
              placeholder="0 8 * * MON-FRI"
              value={cron}
              onInput={(event) => setCron(event.currentTarget.value)}
            />
          </label>
        )}
        <label>
          {words.priority}
          <input
            type="number"
            step={1}
            value={priority}
            onInput={(event) => setPriority(event.currentTarget.value)}
          />
        </label>
        <p class="home-note">{fill(words.note, { zone: ZONE })}</p>
      </form>
    </Dialog>
  );
}
