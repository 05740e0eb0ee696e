// Plays graphs of bench/ with bpmn-elements or bpmn-engine, named as the first argument: each line
// of standard input is an order as JSON, its answer a line, as of bench/play_m2pem.py.
import { EventEmitter } from 'node:events';
import { readFileSync } from 'node:fs';
import BpmnModdle from 'bpmn-moddle';
import * as elements from 'bpmn-elements';
import { Engine } from 'bpmn-engine';
import * as serializer from 'moddle-context-serializer';

const ENOUGH_S = 0.3;
const MOST_TIMES = 20;
let order;

function cpuSeconds() {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1e6;
}

function inData(text) {
  return text.replace(/[a-z]\w*/g, 'data.$&');
}

// Scripts and conditions are left to the application by both: functions, compiled once for a text.
const compiled = new Map();
function functionOf(body) {
  if (!compiled.has(body)) compiled.set(body, new Function('data', body));
  return compiled.get(body);
}

// Each goes on from a new stack, or a row of some 500 tasks would overflow it.
function scriptsOn(data) {
  return {
    register() {},
    getScript(language, { type, behaviour }) {
      if (type === 'bpmn:ScriptTask') {
        const run = functionOf(`${inData(behaviour.script)};`);
        return { execute: (_, next) => setImmediate(() => { run(data); next(); }) };
      }
      const condition = behaviour?.conditionExpression?.body;
      if (condition === undefined) return undefined;
      const test = functionOf(`return (${inData(condition)});`);
      return { execute: (_, next) => setImmediate(() => next(null, test(data))) };
    },
  };
}

async function parse() {
  const { rootElement, references, elementsById } = await new BpmnModdle().fromXML(order.xml);
  return serializer.Serializer({ rootElement, references, elementsById }, serializer.TypeResolver(elements));
}

function withElements(context, data, seen) {
  return new Promise((resolve, reject) => {
    const environment = new elements.Environment({ scripts: scriptsOn(data) });
    const definition = new elements.Definition(new elements.Context(context, environment));
    definition.broker.subscribeTmp('event', 'activity.enter', (_, { content }) => {
      if (content.id[0] === 't') seen.tasks += 1;
    }, { noAck: true });
    definition.on('leave', resolve);
    definition.on('error', reject);
    definition.run();
  });
}

async function withEngine(context, data, seen) {
  const engine = new Engine({ name: 'bench', sourceContext: context, scripts: scriptsOn(data) });
  const ended = Promise.race([
    engine.waitFor('end'),
    engine.waitFor('error').then((error) => { throw error; }),
  ]);
  const listener = new EventEmitter();
  listener.on('activity.enter', ({ id }) => { if (id[0] === 't') seen.tasks += 1; });
  await engine.execute({ listener });
  await ended;
}

const play = { 'bpmn-elements': withElements, 'bpmn-engine': withEngine }[process.argv[2]];

async function all(context) {
  const outcomes = [];
  const began = cpuSeconds();
  for (let number = 0; number < order.instances; number += 1) {
    const data = { ...order.given };
    const seen = { ended: 'running', data, tasks: 0 };
    await play(context, data, seen);
    seen.ended = 'completed';
    outcomes.push(seen);
  }
  return [cpuSeconds() - began, outcomes];
}

for (const line of readFileSync(0, 'utf8').trim().split('\n')) {
  order = JSON.parse(line);
  const began = cpuSeconds();
  const context = await parse();
  const parse_s = cpuSeconds() - began;
  const times = [];
  let outcomes;
  let total = 0;
  const enough = order.enough_s ?? ENOUGH_S;
  while (!times.length || (total < enough && times.length < MOST_TIMES)) {
    let spent;
    [spent, outcomes] = await all(context);
    times.push(spent);
    total += spent;
  }
  times.sort((a, b) => a - b);
  const [first] = outcomes;
  const different = outcomes.filter((each) => JSON.stringify(each) !== JSON.stringify(first));
  console.log(JSON.stringify({
    parse_s,
    cpu_s: times[Math.floor(times.length / 2)],
    // Not maxRSS, which begins with the memory of the process that started this one.
    peak_kb: Number(readFileSync('/proc/self/status', 'utf8').match(/VmHWM:\s*(\d+)/)[1]),
    outcomes: [first, ...different],
    instances: outcomes.length,
  }));
}
