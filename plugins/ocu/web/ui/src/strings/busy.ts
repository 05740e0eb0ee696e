// Texts of a start whose vehicles are busy: who has them, and what can be done.
export const busy = {
  title: "Vehicles are busy",
  text: "Others have vehicles that {mission} names:",
  vehicle: "Vehicle",
  holder: "Has it",
  does: "Does",
  operator: "{who}, by hand",
  nothing: "named by the mission, no task has it now",
  free: "free now",
  wait: "Wait in the queue",
  waitHint: "“Wait in the queue” starts it as soon as all its vehicles are free.",
  queued: "{mission} waits as {entry} until its vehicles are free.",
  choose: "Choose other vehicles",
  chooseHint:
    "Select a task and give it another vehicle. “Chosen when the task starts” takes any that is free and fits.",
  stop: "Stop {run}…",
  stopSure: "Stop {run}: its mission ends",
  stopping: "{run} is being stopped. Its vehicles are free when they have stopped.",
  start: "Start now",
  startHint:
    "“Start all the same” starts it at once. A task whose vehicle is busy then waits, fails, or takes it by its priority, as the mission and the fleet say.",
  yes: "Start all the same",
  no: "Do not start",
} as const;
