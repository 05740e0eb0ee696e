// The values of what is plotted at one time: for everybody who reads, also with a screen reader.
import { clockTenths } from "../../shared/format";
import { fill, strings } from "../../strings";
import type { TelemetryHistory } from "./history";
import { nameOf } from "./names";
import { Swatch } from "./Swatch";
import { readValue } from "./values";

const text = strings.plots;

export interface ValuesProps {
  history: TelemetryHistory;
  resources: readonly string[];
  fields: readonly string[];
  t: number;
  isNow: boolean;
}

export function ValuesTable({ history, resources, fields, t, isNow }: ValuesProps) {
  return (
    <table class="plot-values">
      <caption>{fill(isNow ? text.tableNow : text.table, { time: clockTenths(t) })}</caption>
      <thead>
        <tr>
          <th scope="col">{text.resource}</th>
          {fields.map((field) => (
            <th key={field} scope="col">
              {nameOf(field)}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {resources.map((resource, index) => (
          <tr key={resource}>
            <th scope="row">
              <Swatch index={index} /> {resource}
            </th>
            {fields.map((field) => (
              <td key={field}>{readValue(history, resource, field, t)}</td>
            ))}
          </tr>
        ))}
      </tbody>
    </table>
  );
}
