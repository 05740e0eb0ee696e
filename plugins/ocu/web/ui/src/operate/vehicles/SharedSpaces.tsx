// Areas and corridors in which few vehicles may be at a time: who is in them, and who waits.
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { resources } from "./resources";

const text = strings.operate.vehicles.space;

export function SharedSpaces() {
  const { scene } = useOperating();
  const spaces = resources.value.shared_space;
  if (scene.mode !== "live" || spaces.length === 0) return null;
  return (
    <section class="teams" aria-label={text.title}>
      <table>
        <caption>{text.title}</caption>
        <thead>
          <tr>
            <th scope="col">{text.name}</th>
            <th scope="col">{text.inside}</th>
            <th scope="col">{text.waiting}</th>
          </tr>
        </thead>
        <tbody>
          {spaces.map(({ name, capacity, holders, waiting }) => (
            <tr key={name}>
              <th scope="row">
                {name}{" "}
                <small>{fill(text.taken, { taken: holders.length, capacity })}</small>
              </th>
              <td>
                {holders.length === 0
                  ? text.free
                  : holders.map(({ vehicle, behavior, lost }) => (
                      <div key={vehicle}>
                        {vehicle} <small>{lost ? text.lost : behavior || text.atRest}</small>
                      </div>
                    ))}
              </td>
              <td>
                {waiting.map(({ run, allocation, task, waited_s, reason }) => (
                  <div key={allocation} title={reason}>
                    {fill(text.waits, { task, run, seconds: Math.round(waited_s) })}
                  </div>
                ))}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </section>
  );
}
