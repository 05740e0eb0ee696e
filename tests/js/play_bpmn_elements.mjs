// Plays one case with bpmn-elements, by its own interface: JSON on standard input, JSON out.
//
// This is the application around the engine: it does what people do, holds the data that scripts
// and conditions share (the engine leaves that to its users), and has a clock of its own.
import { readFileSync } from 'node:fs';
import BpmnModdle from 'bpmn-moddle';
import * as elements from 'bpmn-elements';
import * as serializer from 'moddle-context-serializer';

const order = JSON.parse(readFileSync(0, 'utf8'));
const answer = { steps: [], ended: 'running', data: null, problem: '', refused: false };
let entered = [];
let waiting = [];

// --- a clock that stands until it is told to go on --------------------------------------------

const RealDate = Date;
const clock = { now: RealDate.UTC(2026, 0, 1), timers: new Map(), count: 0 };

globalThis.Date = class extends RealDate {
  constructor(...args) {
    if (args.length) super(...args);
    else super(clock.now);
  }

  static now() {
    return clock.now;
  }
};

const timers = new elements.Timers({
  setTimeout(callback, delay, ...args) {
    const id = ++clock.count;
    clock.timers.set(id, { at: clock.now + Math.max(0, delay), callback: () => callback(...args) });
    return id;
  },
  clearTimeout(id) {
    clock.timers.delete(id);
  },
});

function advance(seconds) {
  const until = clock.now + Math.round(seconds * 1000);
  for (;;) {
    const due = [...clock.timers].filter(([, { at }]) => at <= until).sort(([, a], [, b]) => a.at - b.at)[0];
    if (!due) break;
    clock.timers.delete(due[0]);
    clock.now = Math.max(clock.now, due[1].at);
    due[1].callback();
    settle();
  }
  clock.now = until;
}

// --- scripts, conditions and expressions ------------------------------------------------------

const data = { ...order.given };
let written = false;
function javascript(expression) {
  return expression
    .replace(/\band\b/g, '&&')
    .replace(/\bor\b/g, '||')
    .replace(/\bnot\b/g, '!')
    .replace(/([\w.]+)\s*\/\s*([\w.]+)/g, '__divide($1, $2)');
}

function divide(a, b) {
  if (b === 0) throw new Error('division by zero');
  return a / b;
}

function evaluate(expression) {
  return new Function('__names', '__divide', `with (__names) { return (${javascript(expression)}); }`)(
    new Proxy(data, {
      has: (_, name) => typeof name === 'string' && !name.startsWith('__'),
      // As in m2pem, what nobody wrote is equal to null, and neither more nor less than anything.
      get: (_, name) => (typeof name === 'string' ? data[name] ?? undefined : undefined),
    }),
    divide,
  );
}

function execute(script) {
  for (const line of script.split('\n').filter((each) => each.trim())) {
    const [, name, expression] = line.match(/^\s*(\w+)\s*=(?!=)\s*(.*)$/) ?? [];
    if (!name) throw new Error(`no assignment: ${line}`);
    data[name] = evaluate(expression);
    written = true;
  }
}

const scripts = {
  register() {},
  getScript(language, owner) {
    const { script, conditionExpression, expression } = owner.behaviour ?? {};
    const condition = conditionExpression?.body ?? expression?.body;
    const isTask = owner.type === 'bpmn:ScriptTask';
    if (!isTask && condition === undefined) return undefined;
    return {
      execute(_, next) {
        let result;
        try {
          result = isTask ? execute(script ?? '') : evaluate(condition);
        } catch (error) {
          return next(error);
        }
        return next(null, result);
      },
    };
  },
};

const plain = elements.Expressions ? elements.Expressions() : null;
const expressions = {
  resolveExpression(text, ...rest) {
    const [, expression] = typeof text === 'string' ? text.match(/^\$\{(.*)\}$/s) ?? [] : [];
    if (expression !== undefined) return evaluate(expression);
    return plain ? plain.resolveExpression(text, ...rest) : text;
  },
  isExpression: (text) => /^\$\{.*\}$/s.test(text ?? ''),
  hasExpression: (text) => /\$\{.*\}/s.test(text ?? ''),
};

// --- the run ----------------------------------------------------------------------------------

// What counts when it has caught: it is entered, or armed, before.
const CATCHES = new Set(['bpmn:BoundaryEvent', 'bpmn:StartEvent']);
let catches;

function isCatch({ $type, incoming = [], eventDefinitions = [] }) {
  return CATCHES.has($type)
    || incoming.some(({ sourceRef }) => sourceRef.$type === 'bpmn:EventBasedGateway')
    || ($type === 'bpmn:IntermediateCatchEvent'
      && eventDefinitions.some((each) => each.$type === 'bpmn:LinkEventDefinition'));
}

// A send task is a service task to the engine: its users say how to send.
function sending(activity) {
  const message = activity.behaviour.messageRef;
  if (activity.type !== 'bpmn:SendTask' || !message) return;
  activity.behaviour.Service = function Sender() {
    this.execute = (_, done) => {
      definition.sendMessage({ id: message.id });
      done();
    };
  };
}

async function load() {
  const { rootElement, references, elementsById } = await new BpmnModdle().fromXML(order.xml);
  catches = new Set(Object.keys(elementsById).filter((id) => isCatch(elementsById[id])));
  const types = serializer.TypeResolver(elements);
  const context = serializer.Serializer({ rootElement, references, elementsById }, types);
  const environment = new elements.Environment({
    scripts, expressions, timers, extensions: { sending, looping }, settings: { enableDummyService: true },
  });
  return new elements.Definition(new elements.Context(context, environment));
}

// The rounds of a loop and the instances of a multi-instance activity are events of its own broker.
function looping(activity) {
  if (!activity.behaviour.loopCharacteristics) return;
  activity.broker.subscribeTmp('execution', 'execute.start', (_, { content }) => {
    if (!content.isRootScope) entered.push(activity.id);
  }, { noAck: true, consumerTag: `rounds-of-${activity.id}` });
}

function watch(definition) {
  definition.broker.subscribeTmp('event', 'activity.#', (key, { content }) => {
    const { id, executionId } = content;
    if (process.env.TRACE) console.error(key, id, executionId);
    if (key === (catches.has(id) ? 'activity.end' : 'activity.enter')) entered.push(id);
    if (key === 'activity.leave' || key === 'activity.end' || key === 'activity.consumed') {
      waiting = waiting.filter((each) => each.executionId !== executionId);
    }
  }, { noAck: true });
  definition.on('activity.wait', (api) => waiting.push(api));
  definition.on('leave', () => {
    if (answer.ended === 'running') answer.ended = 'completed';
  });
  definition.on('error', (error) => {
    answer.ended = 'failed';
    answer.problem = String(error.content?.error?.message ?? error.message ?? error);
  });
}

// Does what is left to the application: manual tasks, and telling conditions that data has changed.
function settle() {
  for (;;) {
    const manual = waiting.find(({ type }) => type === 'bpmn:ManualTask');
    if (manual) {
      waiting = waiting.filter((each) => each !== manual);
      manual.signal();
    } else if (written) {
      written = false;
      for (const each of waiting) if (each.content.condition) each.signal();
    } else {
      return;
    }
  }
}

function step({ verb, name, word, number, seconds, data: payload }) {
  switch (verb) {
    case 'start':
      definition.run();
      break;
    case 'answer': {
      const tasks = waiting.filter(({ id }) => id === name);
      if (tasks.length < number) throw new RangeError(`${name} does not wait`);
      waiting = waiting.filter((each) => each !== tasks[number - 1]);
      data.user = { decision: word || 'done' };
      written = true;
      tasks[number - 1].signal();
      break;
    }
    case 'signal':
      definition.signal({ ...payload, id: name });
      break;
    case 'message':
      definition.sendMessage({ ...payload, id: name });
      break;
    case 'advance':
      advance(seconds);
      break;
    default:
      throw new RangeError(`${verb} is unknown here`);
  }
  settle();
}

let definition;
try {
  definition = await load();
  watch(definition);
} catch (error) {
  answer.refused = true;
  answer.problem = String(error.message ?? error);
}
if (!answer.refused) {
  for (const each of order.steps) {
    entered = [];
    try {
      step(each);
    } catch (error) {
      answer.problem = String(error.message ?? error);
      if (!(error instanceof RangeError) || /call stack/.test(answer.problem)) answer.ended = 'failed';
    }
    answer.steps.push(entered);
    if (answer.problem) break;
  }
}
console.log(JSON.stringify(answer));
