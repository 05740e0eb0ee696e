// Draws a mission of element templates, as a person does in Camunda Modeler or bpmn-js.
// node apply_templates.mjs cloud|platform TEMPLATES  < STEPS
//
// `cloud` is the modeler with Camunda 8's templates, `platform` with Camunda 7's. STEPS is JSON:
// [{"template": name, "category": name, "values": {label: text}}, ...]; the steps become tasks in a
// row, and their values are typed into the fields of the properties panel. Prints JSON: the saved
// `xml`, and the `errors` of templates, of fields, and of reading the saved file by the descriptor
// of its extension elements.
import { readFile } from 'node:fs/promises';
import { text } from 'node:stream/consumers';
import { validate, validateZeebe } from '@bpmn-io/element-templates-validator';
import BpmnModdle from 'bpmn-moddle';

import { evaluate } from './chromium.mjs';

const [kind, file] = process.argv.slice(2);
const MODELER = new URL(
  `node_modules/camunda-bpmn-js/dist/camunda-${kind}-modeler.production.min.js`, import.meta.url);

// Runs in the browser.
async function model({ templates, steps }) {
  const errors = [];
  const modeler = new BpmnModeler({ container: '#canvas', propertiesPanel: { parent: '#panel' } });
  modeler.on('elementTemplates.errors', (event) => errors.push(...event.errors.map(String)));
  await modeler.createDiagram();
  modeler.get('elementTemplatesLoader').setTemplates(templates);
  const elementTemplates = modeler.get('elementTemplates');
  const modeling = modeler.get('modeling');
  const registry = modeler.get('elementRegistry');

  const rendered = async (find, what) => {
    for (let round = 0; round < 100; round += 1) {
      const found = find();
      if (found) return found;
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    throw new Error(`the properties panel shows no ${what}`);
  };
  // The panel follows the selection only when it has been rendered for the first time.
  const select = (shape) => rendered(() => {
    if (document.querySelector('#bio-properties-panel-id')?.value === shape.id) return true;
    modeler.get('selection').select([]);
    modeler.get('selection').select(shape);
    return false;
  }, shape.id);
  const fieldOf = (label) => {
    const named = [...document.querySelectorAll('#panel label')].find((each) =>
      each.textContent.trim() === label && /-custom-entry-|^custom-/.test(each.htmlFor));
    return named && document.getElementById(named.htmlFor);
  };
  const type = async (label, value) => {
    const field = await rendered(() => fieldOf(label), `field ${label}`);
    const dropdown = field.tagName === 'SELECT';
    if (dropdown && ![...field.options].some((option) => option.value === value)) {
      throw new Error(`the field ${label} does not offer ${value}`);
    }
    field.focus();
    field.value = value;
    field.dispatchEvent(new Event('input', { bubbles: true }));
    field.blur();
  };

  let last = registry.find((each) => each.type === 'bpmn:StartEvent');
  for (const [place, { template, category, values }] of steps.entries()) {
    const chosen = elementTemplates.getLatest().find((each) =>
      each.name === template && each.category.name === category);
    if (!chosen) throw new Error(`there is no template ${category}: ${template}`);
    const at = { x: 320 + 160 * place, y: 200 };
    const task = modeling.appendShape(last, { type: 'bpmn:Task' }, at);
    last = elementTemplates.applyTemplate(task, chosen) ?? registry.get(task.id);
    modeling.updateProperties(last, { name: template });
    await select(last);
    for (const [label, value] of Object.entries(values)) await type(label, value);
    // The browser's time is virtual: it passes when the page has nothing left to render.
    await new Promise((resolve) => setTimeout(resolve, 1_000));
    for (const each of document.querySelectorAll('#panel .bio-properties-panel-error')) {
      errors.push(each.textContent);
    }
  }
  modeling.appendShape(last, { type: 'bpmn:EndEvent' }, { x: 320 + 160 * steps.length, y: 200 });
  const { xml } = await modeler.saveXML({ format: true });
  return { xml, errors };
}

const templates = JSON.parse(await readFile(file, 'utf8'));
const judge = kind === 'cloud' ? validateZeebe : validate;
const invalid = templates.flatMap((each) =>
  (judge(each).errors ?? []).map(({ message }) => `${each.name}: ${message}`));
const steps = JSON.parse(await text(process.stdin));
const { xml, errors } = await evaluate(MODELER, model, { templates, steps });
const prefix = kind === 'cloud' ? 'zeebe' : 'camunda';
const descriptor = JSON.parse(await readFile(
  new URL(`node_modules/${prefix}-bpmn-moddle/resources/${prefix}.json`, import.meta.url), 'utf8'));
const { warnings } = await new BpmnModdle({ [prefix]: descriptor }).fromXML(xml);
const lost = warnings.map(({ message }) => message);
console.log(JSON.stringify({ xml, errors: [...invalid, ...errors, ...lost] }));
