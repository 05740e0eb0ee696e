import { MissionProperties } from "./provider";

export const propertiesModule = {
  __init__: ["missionProperties"],
  missionProperties: ["type", MissionProperties],
};
