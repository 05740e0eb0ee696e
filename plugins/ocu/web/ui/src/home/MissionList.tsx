// The missions of the folder.
import { useRef, useState } from "preact/hooks";
import { remove } from "../shared/api";
import { Dialog } from "../shared/Dialog";
import { go } from "../shared/router";
import { may, session } from "../shared/session";
import { attempt } from "../shared/Toasts";
import { moment } from "../shared/moments";
import type { MissionLine } from "../shared/types";
import { fill, strings } from "../strings";
import { Link } from "./Link";
import { NewMission, type Beginning } from "./NewMission";
import { useList } from "./useList";

const words = strings.home;

export function MissionList() {
  const { lines, failed, refresh } = useList<MissionLine>("/missions");
  const [search, setSearch] = useState("");
  const [beginning, setBeginning] = useState<Beginning | null>(null);
  const [leaving, setLeaving] = useState<MissionLine | null>(null);
  const file = useRef<HTMLInputElement>(null);
  const found = lines?.filter(({ name, title }) =>
    `${name} ${title}`.toLowerCase().includes(search.trim().toLowerCase()),
  );
  const chosen = async (input: HTMLInputElement) => {
    const [first] = input.files ?? [];
    input.value = "";
    if (first) setBeginning({ file: first.name, content: await first.text() });
  };
  const drop = async (mission: MissionLine) => {
    setLeaving(null);
    await attempt(() => remove(`/missions/${encodeURIComponent(mission.name)}`));
    await refresh();
  };
  return (
    <section aria-labelledby="missions-head">
      <div class="home-head">
        <h1 id="missions-head">{words.missions}</h1>
        <input
          type="search"
          placeholder={words.find}
          aria-label={words.find}
          value={search}
          onInput={(event) => setSearch(event.currentTarget.value)}
        />
        <span class="home-stretch" />
        {may("commander") && (
          <>
            <button type="button" class="secondary" onClick={() => file.current?.click()}>
              {words.upload}
            </button>
            <button type="button" class="primary" onClick={() => setBeginning({})}>
              {words.newMission}
            </button>
            <input
              ref={file}
              type="file"
              accept=".bpmn,.bpmn2,.xml"
              hidden
              aria-label={words.upload}
              onChange={(event) => void chosen(event.currentTarget)}
            />
          </>
        )}
      </div>
      {failed && <p role="alert">{words.failed}</p>}
      {lines?.length === 0 && <p class="home-none">{words.noMissions}</p>}
      {lines && lines.length > 0 && found?.length === 0 && (
        <p class="home-none">{words.noneFound}</p>
      )}
      {found && found.length > 0 && (
        <div class="home-scroll">
          <table class="home-table">
            <thead>
              <tr>
                <th scope="col">{words.name}</th>
                <th scope="col">{words.savedAt}</th>
                <th scope="col">{words.by}</th>
                <th scope="col">
                  <span class="home-hidden">{words.remove}</span>
                </th>
              </tr>
            </thead>
            <tbody>
              {found.map((mission) => (
                <MissionRow
                  key={mission.name}
                  mission={mission}
                  leave={() => setLeaving(mission)}
                />
              ))}
            </tbody>
          </table>
        </div>
      )}
      <p class="home-note">
        {fill(words.folder, { folder: session.value?.missions_folder ?? "" })}
      </p>
      {beginning && (
        <NewMission
          beginning={beginning}
          taken={lines?.map(({ name }) => name) ?? []}
          close={() => setBeginning(null)}
        />
      )}
      {leaving && (
        <Dialog
          title={fill(words.removeTitle, { name: leaving.name })}
          onClose={() => setLeaving(null)}
          actions={
            <>
              <button type="button" class="secondary" onClick={() => setLeaving(null)}>
                {words.cancel}
              </button>
              <button type="button" class="primary" onClick={() => void drop(leaving)}>
                {words.remove}
              </button>
            </>
          }
        >
          <p>{words.removeText}</p>
        </Dialog>
      )}
    </section>
  );
}

function MissionRow({ mission, leave }: { mission: MissionLine; leave(): void }) {
  const { name, title, saved_at_us, by, runnable } = mission;
  const path = `/missions/${encodeURIComponent(name)}`;
  return (
    <tr onDblClick={() => go(path)}>
      <td>
        <Link to={path}>{name}</Link>
        {title && title !== name && <span class="home-title">{title}</span>}
        {!runnable && <span class="home-chip home-chip-bad">{words.notRunnable}</span>}
      </td>
      <td class="home-when">{moment(saved_at_us / 1000)}</td>
      <td>{by}</td>
      <td class="home-actions">
        {may("commander") && (
          <button
            type="button"
            class="plain"
            title={fill(words.removeLabel, { name })}
            aria-label={fill(words.removeLabel, { name })}
            onClick={leave}
          >
            ×
          </button>
        )}
      </td>
    </tr>
  );
}
