// How well the members of a march keep their places.
import { usePaced } from "../layout/pace";
import { fill, strings } from "../../strings";
import type { TeamState } from "../../shared/types";
import { useOperating } from "../context";
import { fixed } from "../../shared/format";

const text = strings.operate.vehicles;

export function Teams() {
  const { scene } = useOperating();
  const states = usePaced(scene.teams, 400);
  const marching = Object.values(states).filter(({ behavior }) => behavior in scene.commands.value);
  if (marching.length === 0) return null;
  return (
    <section class="teams" aria-label={text.teams}>
      {marching.map((team) => (
        <table key={team.behavior}>
          <caption>
            {team.name} · {fill(text.team, { spacing: fixed(team.spacing_m, 0) })}
          </caption>
          <tbody>
            {team.members.map((member) => (
              <tr key={member.resource}>
                <th scope="row">{member.resource}</th>
                <td>{place(member)}</td>
                <td>
                  {member.gap_m !== null && fill(text.gap, { metres: fixed(member.gap_m, 1) })}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      ))}
    </section>
  );
}

function place({ along_m, aside_m }: TeamState["members"][number]): string {
  const parts: string[] = [];
  const metres = (value: number) => ({ metres: fixed(Math.abs(value), 1) });
  if (along_m !== null && Math.abs(along_m) >= 0.5) {
    parts.push(fill(along_m > 0 ? text.ahead : text.behind, metres(along_m)));
  }
  if (aside_m !== null && Math.abs(aside_m) >= 0.5) parts.push(fill(text.aside, metres(aside_m)));
  return parts.join(", ") || (along_m === null ? "" : text.inPlace);
}
