// All alerts, those that are over too, and how this browser tells new ones.
import { useEffect, useState } from "preact/hooks";
import { get } from "../shared/api";
import { alertChanges, unknownSince } from "../shared/executive";
import { moment } from "../shared/moments";
import { may } from "../shared/session";
import { fill, strings } from "../strings";
import { Age, AlertActions, AlertText, SeverityMark, Source } from "./AlertLine";
import {
  acknowledgeAll,
  alerts as openAlerts,
  announcer,
  calling,
  change,
  failed,
  settings,
} from "./alerts";
import { EarlierMessages } from "./EarlierMessages";
import { SoundHint } from "./SoundHint";
import { askToNotify, mayNotify } from "./outputs";
import { isAtLeast, SEVERITIES, type OperatorAlert, type Severity } from "./types";
import "../home/home.css";
import "./alerts.css";

const words = strings.alerts;
const columns = words.columns;

export default function AlertPage() {
  const past = usePast();
  const [least, setLeast] = useState<Severity>("notice");
  const [text, setText] = useState("");
  const wanted = (each: OperatorAlert) =>
    isAtLeast(each.severity, least) &&
    [each.alert, each.code, each.text, each.run, each.owner, each.acknowledged_by, ...each.resources]
      .join(" ")
      .toLowerCase()
      .includes(text.trim().toLowerCase());
  const now = openAlerts.value.filter(wanted);
  const over = past.filter(wanted);
  return (
    <div class={unknownSince.value === null ? "alert-page" : "alert-page stale"}>
      <div class="home-head">
        <h1>{words.title}</h1>
        <label>
          {words.leastSevere}{" "}
          <select
            value={least}
            onChange={(event) => setLeast(event.currentTarget.value as Severity)}
          >
            {[...SEVERITIES].reverse().map((each) => (
              <option key={each} value={each}>
                {words.shown[each]}
              </option>
            ))}
          </select>
        </label>
        <input
          type="search"
          aria-label={words.find}
          placeholder={words.find}
          value={text}
          onInput={(event) => setText(event.currentTarget.value)}
        />
        <span class="home-stretch" />
        {may("operator") && calling.value.length > 1 && (
          <button
            type="button"
            class="secondary"
            onClick={() => void acknowledgeAll(calling.value)}
          >
            {fill(words.acknowledgeAll, { count: calling.value.length })}
          </button>
        )}
      </div>
      {failed.value && <p role="alert">{words.failed}</p>}
      {now.length === 0 && (
        <p class="home-none">{openAlerts.value.length > 0 ? words.noneFound : words.none}</p>
      )}
      {now.length > 0 && <Table alerts={now} />}
      {over.length > 0 && (
        <section aria-labelledby="alerts-over">
          <h2 id="alerts-over">{words.history}</h2>
          <Table alerts={over} over />
        </section>
      )}
      <EarlierMessages />
      <Settings />
    </div>
  );
}

/** Alerts that are over, read again after each change. */
function usePast(): readonly OperatorAlert[] {
  const [past, setPast] = useState<readonly OperatorAlert[]>([]);
  useEffect(() => {
    const read = async () => {
      try {
        const found = await get<OperatorAlert[]>("/alerts?over=true");
        setPast(found.filter(({ cleared_us }) => cleared_us !== null));
      } catch {
        // `failed` says so.
      }
    };
    return alertChanges.subscribe(() => void read());
  }, []);
  return past;
}

function Table({ alerts, over = false }: { alerts: readonly OperatorAlert[]; over?: boolean }) {
  return (
    <div class="home-scroll">
      <table class="home-table alert-table">
        <thead>
          <tr>
            <th scope="col">{columns.severity}</th>
            <th scope="col">{columns.alert}</th>
            <th scope="col">{columns.source}</th>
            <th scope="col">{columns.raised}</th>
            <th scope="col">{columns.age}</th>
            <th scope="col">{columns.acknowledged}</th>
            <th scope="col">{columns.owner}</th>
            <th scope="col">
              {over ? columns.over : <span class="home-hidden">{columns.actions}</span>}
            </th>
          </tr>
        </thead>
        <tbody>
          {alerts.map((alert) => (
            <tr key={alert.alert} class={alert.calls ? "alert-row-calls" : ""}>
              <td>
                <SeverityMark severity={alert.severity} />
              </td>
              <td class="alert-cell">
                <AlertText alert={alert} />
              </td>
              <td>
                <Source alert={alert} />
              </td>
              <td class="home-when" data-label={columns.raised}>
                {moment(alert.raised_us / 1000)}
              </td>
              <td class="home-when">
                <Age alert={alert} />
              </td>
              <td data-label={columns.acknowledged}>{seenBy(alert)}</td>
              <td data-label={columns.owner}>{alert.owner || "–"}</td>
              {over ? (
                <td class="home-when" data-label={columns.over}>
                  {moment((alert.cleared_us ?? 0) / 1000)}
                </td>
              ) : (
                <td class="home-actions">
                  <AlertActions alert={alert} />
                </td>
              )}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function seenBy({ acknowledged_by: who, acknowledged_us }: OperatorAlert): string {
  if (!who || acknowledged_us === null) return "–";
  return fill(words.acknowledged, { who, when: moment(acknowledged_us / 1000) });
}

const SOUNDS = ["off", "critical", "error", "warning"] as const;

function Settings() {
  const { sound, notify, vibrate, speech } = settings.value;
  const [denied, setDenied] = useState(false);
  const toggleNotify = async (wanted: boolean) => {
    const granted = wanted && (mayNotify() || (await askToNotify()));
    setDenied(wanted && !granted);
    change({ notify: granted });
  };
  return (
    <section class="alert-settings" aria-labelledby="alert-settings">
      <h2 id="alert-settings">{words.settings}</h2>
      <p>{words.settingsHint}</p>
      <label>
        {words.sound}{" "}
        <select
          value={sound}
          onChange={(event) => change({ sound: event.currentTarget.value as typeof sound })}
        >
          {SOUNDS.map((each) => (
            <option key={each} value={each}>
              {words.soundFrom[each]}
            </option>
          ))}
        </select>
      </label>
      <SoundHint isBrief />
      <p class="alert-hint">{words.repeated}</p>
      <Check
        label={words.notify}
        checked={notify}
        onChange={(wanted) => void toggleNotify(wanted)}
      />
      {denied && <p role="alert">{words.notifyDenied}</p>}
      <Check
        label={words.vibrate}
        checked={vibrate}
        onChange={(wanted) => change({ vibrate: wanted })}
      />
      <Check
        label={words.speech}
        checked={speech}
        onChange={(wanted) => change({ speech: wanted })}
      />
      <button
        type="button"
        class="secondary"
        onClick={() =>
          announcer.tell([
            { severity: sound === "off" ? "error" : sound, text: words.testText, run: "" },
          ])
        }
      >
        {words.test}
      </button>
    </section>
  );
}

interface CheckProps {
  label: string;
  checked: boolean;
  onChange(checked: boolean): void;
}

function Check({ label, checked, onChange }: CheckProps) {
  return (
    <label class="alert-check">
      <input
        type="checkbox"
        checked={checked}
        onChange={(event) => onChange(event.currentTarget.checked)}
      />
      {label}
    </label>
  );
}
