// Which new version a run is to go on with: a mission of the folder, a file of this computer, or a
// version that the run has had.
import { useEffect, useRef, useState } from "preact/hooks";
import { nameOfFile, versionsOf, type Version } from "../missions/files";
import { get } from "../shared/api";
import { moment } from "../shared/moments";
import type { MissionLine } from "../shared/types";
import { fill, strings } from "../strings";
import type { NewVersion } from "./plan";
import { nameOf, versionsOfRun, type RunVersion } from "./versions";

const words = strings.revise;

export interface VersionChoiceProps {
  run: string;
  chosen: NewVersion | null;
  choose(version: NewVersion | null): void;
  fail(error: unknown): void;
}

export function VersionChoice({ run, chosen, choose, fail }: VersionChoiceProps) {
  const [missions, setMissions] = useState<readonly MissionLine[]>([]);
  const [versions, setVersions] = useState<readonly Version[]>([]);
  const [had, setHad] = useState<readonly RunVersion[]>([]);
  const [isOver, setOver] = useState(false);
  const input = useRef<HTMLInputElement>(null);
  const mission = chosen?.kind === "mission" ? chosen.mission : "";
  useEffect(() => {
    get<MissionLine[]>("/missions").then(setMissions, fail);
    versionsOfRun(run).then(setHad, fail);
  }, [run]);
  useEffect(() => {
    let left = false;
    setVersions([]);
    if (mission) {
      versionsOf(mission).then((all) => {
        if (!left) setVersions([...all].reverse());
      }, fail);
    }
    return () => {
      left = true;
    };
  }, [mission]);
  const take = async (file: File | undefined) => {
    if (!file) return;
    try {
      const xml = await file.text();
      choose({ kind: "file", mission: nameOfFile(file.name), file: file.name, xml });
    } catch (error) {
      fail(error);
    }
  };
  const present = had.at(-1)?.version;
  const earlier = had
    .map((each, at) => ({ each, number: at + 1 }))
    .filter(({ each }) => each.version !== present);
  return (
    <div
      class={isOver ? "rev-choose rev-over" : "rev-choose"}
      role="group"
      aria-label={words.choose}
      onDragOver={(event) => {
        event.preventDefault();
        setOver(true);
      }}
      onDragLeave={() => setOver(false)}
      onDrop={(event) => {
        event.preventDefault();
        setOver(false);
        void take(event.dataTransfer?.files[0]);
      }}
    >
      <label>
        {words.mission}
        <select
          value={mission}
          onChange={({ currentTarget: { value } }) =>
            choose(value ? { kind: "mission", mission: value, version: "" } : null)
          }
        >
          <option value="">{words.none}</option>
          {missions.map(({ name }) => (
            <option key={name} value={name}>
              {name}
            </option>
          ))}
        </select>
      </label>
      {chosen?.kind === "mission" && (
        <label>
          {words.version}
          <select
            value={chosen.version}
            onChange={({ currentTarget: { value } }) => choose({ ...chosen, version: value })}
          >
            <option value="">{words.newest}</option>
            {versions.map(({ number, version, by, saved_at_us }) => (
              <option key={number} value={version}>
                {fill(by ? words.versionOf : words.versionBare, {
                  number,
                  by,
                  at: moment(saved_at_us / 1000),
                })}
              </option>
            ))}
          </select>
        </label>
      )}
      {earlier.length > 0 && (
        <label>
          {words.had}
          <select
            value={chosen?.kind === "had" ? String(chosen.number) : ""}
            onChange={({ currentTarget: { value } }) => {
              const found = earlier.find(({ number }) => String(number) === value);
              choose(
                found ? { kind: "had", version: found.each.version, number: found.number } : null,
              );
            }}
          >
            <option value="">{words.noneHad}</option>
            {earlier.map(({ each, number }) => (
              <option key={number} value={String(number)}>
                {nameOf(each, number)}
              </option>
            ))}
          </select>
        </label>
      )}
      <button type="button" class="secondary" onClick={() => input.current?.click()}>
        {words.file}
      </button>
      <input
        ref={input}
        type="file"
        accept=".bpmn,.bpmn2,.xml"
        hidden
        aria-label={words.file}
        onChange={({ currentTarget }) => {
          const [first] = currentTarget.files ?? [];
          currentTarget.value = "";
          void take(first);
        }}
      />
      <p>{chosen?.kind === "file" ? fill(words.chosenFile, { name: chosen.file }) : words.drop}</p>
    </div>
  );
}
