// Above the table: search, filters with how many they would show, and groups.
import { fill, strings } from "../strings";
import { FILTERS, GROUPINGS, type Filter, type Grouping } from "./rows";
import { filters, grouping, search, selected, withPayloads } from "./state";

const text = strings.fleet;

export interface FleetToolsProps {
  counts: Record<Filter, number>;
  shown: number;
  all: number;
  hasPayloads: boolean;
}

export function FleetTools({ counts, shown, all, hasPayloads }: FleetToolsProps) {
  const turn = (filter: Filter) => {
    const next = new Set(filters.value);
    if (!next.delete(filter)) next.add(filter);
    filters.value = next;
  };
  return (
    <div class="fleet-tools">
      <input
        type="search"
        aria-label={text.search}
        placeholder={text.searchHint}
        value={search.value}
        onInput={(event) => (search.value = event.currentTarget.value)}
      />
      <label>
        {text.group}{" "}
        <select
          value={grouping.value}
          onChange={(event) => (grouping.value = event.currentTarget.value as Grouping)}
        >
          {GROUPINGS.map((each) => (
            <option key={each} value={each}>
              {text.groups[each]}
            </option>
          ))}
        </select>
      </label>
      {hasPayloads && (
        <label class="switch">
          <input
            type="checkbox"
            checked={withPayloads.value}
            onChange={(event) => (withPayloads.value = event.currentTarget.checked)}
          />
          {text.withPayloads}
        </label>
      )}
      <span class="fleet-count" role="status">
        {fill(text.shown, { shown, all })}
        {selected.value.size > 0 && (
          <>
            {" · "}
            {fill(text.selected.many, { count: selected.value.size })}{" "}
            <button type="button" class="plain" onClick={() => (selected.value = new Set())}>
              {text.clear}
            </button>
          </>
        )}
      </span>
      <div class="fleet-chips" role="group" aria-label={text.filters.label}>
        {FILTERS.map((filter) => (
          <button
            key={filter}
            type="button"
            class={counts[filter] > 0 ? `fleet-chip fleet-chip-${filter}` : "fleet-chip"}
            aria-pressed={filters.value.has(filter)}
            onClick={() => turn(filter)}
          >
            {text.filters[filter]} <b>{counts[filter]}</b>
          </button>
        ))}
      </div>
    </div>
  );
}
