// Every version that was saved, the newest first.
import { useEffect, useState } from "preact/hooks";
import { Dialog } from "../../shared/Dialog";
import { toast } from "../../shared/Toasts";
import { moment } from "../../shared/moments";
import { fill, strings } from "../../strings";
import { versionsOf, type Version } from "../../missions/files";
import type { MissionWork } from "../session/MissionWork";

const words = strings.editor.versions;

export function VersionsDialog({ work, close }: { work: MissionWork; close(): void }) {
  const [versions, setVersions] = useState<readonly Version[] | null>(null);
  useEffect(() => {
    versionsOf(work.mission).then(
      (all) => setVersions([...all].sort((a, b) => b.number - a.number)),
      () => {
        toast(words.failed, "bad");
        close();
      },
    );
  }, []);
  const open = (number: number) => {
    close();
    work.openVersion(number).catch(() => toast(words.failed, "bad"));
  };
  return (
    <Dialog title={fill(words.title, { name: work.mission })} onClose={close} wide>
      {versions === null ? (
        <p>{strings.editor.loading}</p>
      ) : (
        <table class="m2-table">
          <thead>
            <tr>
              <th scope="col">{words.number}</th>
              <th scope="col">{words.saved}</th>
              <th scope="col">{words.by}</th>
              <th scope="col">
                <span class="m2-hidden">{words.open}</span>
              </th>
            </tr>
          </thead>
          <tbody>
            {versions.map(({ number, saved_at_us, by }, index) => (
              <tr key={number}>
                <td>
                  {number} {index === 0 && <span class="m2-chip">{words.newest}</span>}
                </td>
                <td>{moment(saved_at_us / 1000)}</td>
                <td>{by}</td>
                <td>
                  <button
                    type="button"
                    class="secondary"
                    aria-label={fill(words.openLabel, { number })}
                    onClick={() => open(number)}
                  >
                    {words.open}
                  </button>
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </Dialog>
  );
}
