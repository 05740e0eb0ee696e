// Texts of the page that is shown while the executive does not answer.
export const offline = {
  title: "No connection to the executive",
  again: "The page tries again every two seconds.",
  noStop: "STOP cannot be sent from here.",
  seen: "What this browser saw last, {when}:",
  ago: "{age} ago",
  runs: "Runs that went on then. They go on without this page, or have ended since:",
  noRuns: "No run went on then.",
  nothing: "This browser has not been connected before.",
} as const;
