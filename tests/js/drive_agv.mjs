// A vehicle of vda-5050-lib: its AgvController with its VirtualAgvAdapter, which drives.
// node drive_agv.mjs BROKER SERIAL VERSION [SPEED]  prints "ready", then a line for each order and instant action that
// it gets. A line of standard input makes something go wrong: see `faults`. It ends with standard input.
import { createInterface } from 'node:readline';
import vda from 'vda-5050-lib';

const [broker, serialNumber, vdaVersion, speed = '1'] = process.argv.slice(2);
const wrong = new Set();

class Adapter extends vda.VirtualAgvAdapter {
  stopTraverse(context) {
    if (wrong.has('drive on after a cancel')) context.stopped();
    else super.stopTraverse(context);
  }

  _startPause(context) {
    return wrong.has('drive on after a pause') ? { paused: true } : super._startPause(context);
  }
}

class Vehicle extends vda.AgvController {
  async publish(topic, object, options) {
    if (topic === vda.Topic.State && wrong.has('another order')) object = { ...object, orderId: 'another' };
    return super.publish(topic, object, options);
  }

  _processOrder(order) {
    console.log(`order ${order.orderUpdateId}`);
    super._processOrder(order);
  }

  _processInstantActions(message) {
    console.log(`instant ${(message.instantActions ?? message.actions)?.map((each) => each.actionType)}`);
    if (!wrong.has('ignore instant actions')) super._processInstantActions(message);
  }
}

const vehicle = new Vehicle(
  { manufacturer: 'm2pem', serialNumber },
  { interfaceName: 'uagv', vdaVersion, transport: { brokerUrl: broker } },
  { agvAdapterType: Adapter, publishStateInterval: 1000, publishVisualizationInterval: 200 },
  {
    initialPosition: { mapId: 'hall', x: 0, y: 0, theta: 0, lastNodeId: '0' },
    vehicleSpeed: 1, tickRate: 20, timeLapse: Number(speed),
  },
);

const faults = {
  'forget the rest': () => vehicle.updatePartialState({ nodeStates: [], edgeStates: [] }, true),
  'jump': () => { vehicle._agvAdapter.vehicleState.position.x += 50; },
  'mode': (mode) => vehicle.updateOperatingMode(mode),
  'fatal': () => vehicle.updateErrors({ errorType: 'laser', errorLevel: 'FATAL', errorDescription: 'blind', errorReferences: [] }, 'add', true),
};

await vehicle.start();
console.log('ready');
for await (const line of createInterface(process.stdin)) {
  const fault = Object.keys(faults).find((each) => line.startsWith(each));
  if (fault === undefined) wrong.add(line);
  else faults[fault](line.slice(fault.length + 1));
  console.log(`fault: ${line}`);
}
await vehicle.stop();
