// Texts about requirements that a run is monitored for.
export const monitors = {
  title: "Requirements",
  titleViolated: "{count} violated",
  none: "The run is not monitored for requirements.",
  states: {
    open: "open",
    satisfied: "satisfied",
    violated: "violated",
  },
  openHint: "not decided yet: what comes next may satisfy or violate it",
  neverDecided: "not decided: the run was stopped before that",
  since: "since {time}",
  because: "What made it certain: {because}",
  throws: { error: "A violation throws error {name} in the mission.", signal: "A violation throws signal {name} in the mission." },
  elements: "Elements",
  formula: "Formula",
  show: "Show its elements",
  showAt: "Show its elements, and go to {time}",
  violated: { one: "{count} requirement violated", many: "{count} requirements violated" },
  open: "Show the requirements",
  element: "violates requirement {names}",
  legend: "a violated requirement is about it",
} as const;
