// Reads BPMN files as bpmn-js and Camunda Modeler do, and writes them again.
// node read_bpmn.mjs FILE...  prints {"FILE": {"warnings": [...], "rewritten": "<?xml ..."}}
import { readFile } from 'node:fs/promises';
import BpmnModdle from 'bpmn-moddle';

const moddle = new BpmnModdle();
const results = {};

for (const file of process.argv.slice(2)) {
  const { rootElement, warnings } = await moddle.fromXML(await readFile(file, 'utf8'));
  const { xml } = await moddle.toXML(rootElement);
  results[file] = { warnings: warnings.map(({ message }) => message), rewritten: xml };
}

console.log(JSON.stringify(results));
