// What m2pem adds to BPMN, as bpmn-moddle reads and writes it (docs/missions.md). Whatever is not
// said here is kept as it stands in the file. vocabulary.test.ts holds the names to m2pem's own.
import { NEEDS } from "./behavior";

const attribute = (name: string) => ({ name, type: "String", isAttr: true });
const children = (name: string, type: string) => ({ name, type, isMany: true });
const text = { name: "body", type: "String", isBody: true };
const others = children("others", "Element");

const task = ["store", "role", "timeout"].map(attribute);

export const m2pemDescriptor = {
  name: "m2pem",
  prefix: "m2pem",
  uri: "https://m2pem.org/schema/1",
  xml: { tagAlias: "lowerCase" },
  associations: [],
  types: [
    {
      name: "Behavior",
      superClass: ["Element"],
      properties: [
        attribute("type"),
        attribute("name"),
        children("head", "Property"),
        { name: "parameters", type: "Properties" },
        { name: "allocation", type: "Resources" },
        others,
      ],
    },
    { name: "Properties", superClass: ["Element"], properties: [children("values", "Property")] },
    {
      name: "Property",
      superClass: ["Element"],
      properties: [attribute("id"), attribute("name"), attribute("value"), text],
    },
    { name: "Resources", superClass: ["Element"], properties: [children("values", "Role")] },
    {
      name: "Role",
      superClass: ["Element"],
      properties: ["name", "vehicle", "payload", "team", "optional", ...NEEDS].map(attribute),
    },
    {
      name: "Service",
      superClass: ["Element"],
      properties: [
        attribute("class"),
        { name: "parameters", type: "Properties" },
        { name: "allocation", type: "Resources" },
        children("roles", "Role"),
        children("loose", "Property"),
        others,
      ],
    },
    {
      name: "UserTask",
      superClass: ["Element"],
      properties: [
        ...task,
        children("prompts", "Prompt"),
        children("decisions", "Decision"),
        others,
      ],
    },
    { name: "Prompt", superClass: ["Element"], properties: [...task, text] },
    {
      name: "Decision",
      superClass: ["Element"],
      properties: [attribute("value"), attribute("label"), text],
    },
    { name: "In", superClass: ["Element"], properties: ["source", "target"].map(attribute) },
    { name: "Out", superClass: ["Element"], properties: ["source", "target"].map(attribute) },
    {
      name: "Requirement",
      superClass: ["Element"],
      properties: [
        ...["id", "ltl", "pattern", "text", "fair", "assume", "monitor", "onViolation"].map(attribute),
        children("args", "Arg"),
      ],
    },
    { name: "Arg", superClass: ["Element"], properties: ["name", "value"].map(attribute) },
    {
      name: "Geometry",
      superClass: ["Element"],
      properties: [...["name", "survey", "surveyor"].map(attribute), text],
    },
    { name: "AskingTask", extends: ["bpmn:UserTask", "bpmn:GlobalUserTask"], properties: task },
    {
      name: "ServingTask",
      extends: ["bpmn:ServiceTask", "bpmn:BusinessRuleTask", "bpmn:GlobalBusinessRuleTask"],
      properties: ["class", "service"].map(attribute),
    },
    {
      name: "Instances",
      extends: ["bpmn:MultiInstanceLoopCharacteristics"],
      properties: ["collection", "elementVariable"].map(attribute),
    },
    {
      name: "Errors",
      extends: ["bpmn:Process"],
      properties: ["onError", "incidentRole"].map(attribute),
    },
    { name: "Pools", extends: ["bpmn:Collaboration"], properties: [attribute("allPools")] },
    { name: "Checked", extends: ["bpmn:Process"], properties: [attribute("assume")] },
    {
      name: "Choice",
      extends: ["bpmn:AdHocSubProcess"],
      properties: [attribute("activeElements")],
    },
    { name: "Sent", extends: ["bpmn:Signal"], properties: ["from", "returned"].map(attribute) },
    {
      name: "Posted",
      extends: ["bpmn:Message"],
      properties: ["from", "correlationKey"].map(attribute),
    },
  ],
};
