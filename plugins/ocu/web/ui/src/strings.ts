// Every text that a person reads, one section a page.
export const strings = {
  shell: {
    title: "m2pem",
    simulated: "Simulated",
    real: "REAL VEHICLES",
    stop: "STOP",
    stopHint: "Stop every run, and every vehicle that a run commands",
    home: "Missions",
    signOut: "Sign out",
    dark: "Dark",
    light: "Light",
    offline: "Not connected to the executive",
  },
  home: {
    missions: "Missions",
    runs: "Runs",
    newMission: "New mission",
    nothing: "There is no such page.",
  },
  editor: {},
  operate: {},
} as const;
