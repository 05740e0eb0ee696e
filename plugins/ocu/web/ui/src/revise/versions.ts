// The versions of its mission that a run has had, and the files that a revision compares.
import { makeEditable, openMission, openVersion, versionsOf } from "../missions/files";
import { get } from "../shared/api";
import { moment } from "../shared/moments";
import { fill, strings } from "../strings";
import type { NewVersion } from "./plan";

const words = strings.revise;

export interface RunVersion {
  version: string;
  mission: string;
  seq: number;
  at_us: number;
  by: string;
  shared_with: string[];
}

/** The files of a run, its own first. */
interface RunFiles {
  files: { xml: string }[];
}

const pathOf = (run: string) => `/runs/${encodeURIComponent(run)}`;

export const versionsOfRun = (run: string) => get<RunVersion[]>(`${pathOf(run)}/versions`);

export const presentXml = async (run: string): Promise<string> =>
  (await get<RunFiles>(`${pathOf(run)}/mission`)).files[0]!.xml;

/** The new version with a diagram. */
export async function xmlOf(run: string, wanted: NewVersion): Promise<string> {
  switch (wanted.kind) {
    case "file":
      return (await makeEditable(wanted.xml)).xml;
    case "had": {
      const version = encodeURIComponent(wanted.version);
      return (await get<RunFiles>(`${pathOf(run)}/mission?version=${version}`)).files[0]!.xml;
    }
    case "mission": {
      if (!wanted.version) return (await openMission(wanted.mission)).xml;
      const all = await versionsOf(wanted.mission);
      const found = all.find(({ version }) => version === wanted.version);
      if (!found) throw new Error(words.noVersion);
      return (await openVersion(wanted.mission, found.number)).xml;
    }
  }
}

/** What a version of a run is called, by its place in the list of them. */
export const nameOf = ({ by, at_us }: RunVersion, number: number): string =>
  fill(by ? words.versionOf : words.versionBare, { number, by, at: moment(at_us / 1000) });
