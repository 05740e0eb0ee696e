// An ONVIF camera by node-soap: it reads each request and writes each answer by the WSDL files of ONVIF.
//
//   node onvif_camera.mjs <folder of WSDL files> <JPEG> <user> <password> <degrees per second>
//
// Prints JSON lines: the port, then each envelope that came or went, and each picture with the direction it shows.
// The head turns at its rate: pan -170 to 170 deg, tilt -60 to 30 deg, zoom 1 to 10, in the generic spaces.

import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';

import soap from 'soap';

const [folder, jpeg, user, password, rate] = process.argv.slice(2);
const print = (line) => process.stdout.write(`${JSON.stringify(line)}\n`);
const now = () => performance.now() / 1000;

const AXES = { pan: [-170, 170], tilt: [-60, 30], zoom: [1, 10] };
const RATES = { pan: Number(rate), tilt: Number(rate), zoom: 5 };
const SPACES = 'http://www.onvif.org/ver10/tptz';
const space = (kind, name) => `${SPACES}/${kind}Spaces/${name}`;
const POSITION = space('PanTilt', 'PositionGenericSpace');
const ZOOM = space('Zoom', 'PositionGenericSpace');
const VELOCITY = space('PanTilt', 'VelocityGenericSpace');

// --- the head: each axis goes to a goal, or runs at a velocity until a time -------------------------------------

const head = Object.fromEntries(
  Object.keys(AXES).map((axis) => [axis, { at: axis === 'zoom' ? 1 : 0, goal: null, velocity: 0, until: 0, since: now() }]),
);

function advance() {
  const time = now();
  for (const [axis, state] of Object.entries(head)) {
    const [low, high] = AXES[axis];
    const way = RATES[axis] * (time - state.since);
    if (state.goal !== null) {
      const left = state.goal - state.at;
      state.at = Math.abs(left) <= way ? state.goal : state.at + Math.sign(left) * way;
      if (state.at === state.goal) state.goal = null;
    } else if (state.velocity) {
      state.at += state.velocity * Math.max(0, Math.min(time, state.until) - state.since);
      state.at = Math.min(Math.max(state.at, low), high);
      if (time >= state.until) state.velocity = 0;
    }
    state.since = time;
  }
}

const units = { pan: [-1, 1], tilt: [-1, 1], zoom: [0, 1] };
const toUnits = (axis, value) => {
  const [low, high] = AXES[axis], [from, to] = units[axis];
  return from + ((value - low) / (high - low)) * (to - from);
};
const toValue = (axis, number) => {
  const [low, high] = AXES[axis], [from, to] = units[axis];
  return low + ((number - from) / (to - from)) * (high - low);
};

function fault(text, ...codes) {
  let code = {};
  for (const each of codes.reverse()) code = { Subcode: { Value: `ter:${each}`, ...code } };
  throw { Fault: { Code: { Value: 'soap:Sender', ...code }, Reason: { Text: text } } };
}

function number(axis, element, name, wanted, [low, high] = units[axis]) {
  const { [name]: said, space: uri = wanted } = element.attributes ?? {};
  const value = Number(said);
  if (uri !== wanted) fault(`no space ${uri}`, 'InvalidArgVal', 'SpaceNotSupported');
  if (!(value >= low && value <= high)) fault(`${name}="${said}" is out of range`, 'InvalidArgVal', 'InvalidPosition');
  return value;
}

function go(axis, value) {
  Object.assign(head[axis], { goal: value, velocity: 0 });
}

function run(axis, share, until) {
  Object.assign(head[axis], { goal: null, velocity: share * RATES[axis], until });
}

// Names the elements of a type of onvif.xsd. node-soap 1.13.0 writes those of an imported schema in the namespace of the
// message, unless they have a prefix; requests it reads right.
function tt(value) {
  if (Array.isArray(value)) return value.map(tt);
  if (typeof value !== 'object') return value;
  return Object.fromEntries(Object.entries(value).map(([key, each]) => (
    key === 'attributes' ? [key, each] : [`tt:${key}`, tt(each)])));
}

// --- the services -----------------------------------------------------------------------------------------------

const range = ([Min, Max]) => ({ Min, Max });
const both = { XRange: range([-1, 1]), YRange: range([-1, 1]) };
const configuration = {
  attributes: { token: 'c0' }, Name: 'head', UseCount: 1, NodeToken: 'n0',
  DefaultAbsolutePantTiltPositionSpace: POSITION, DefaultPTZTimeout: 'PT5S',
};
const node = {
  attributes: { token: 'n0' }, Name: 'head',
  SupportedPTZSpaces: {
    AbsolutePanTiltPositionSpace: [{ URI: POSITION, ...both }],
    AbsoluteZoomPositionSpace: [{ URI: ZOOM, XRange: range([0, 1]) }],
    ContinuousPanTiltVelocitySpace: [{ URI: VELOCITY, ...both }],
  },
  MaximumNumberOfPresets: 0, HomeSupported: false,
};

function seconds(duration) {
  const [, s] = /^PT([\d.]+)S$/.exec(duration ?? 'PT5S') ?? fault(`Timeout ${duration}`, 'InvalidArgVal');
  return Number(s);
}

const PTZ = {
  GetNodes: () => ({ PTZNode: [tt(node)] }),
  GetNode: () => ({ PTZNode: tt(node) }),
  GetConfigurations: () => ({ PTZConfiguration: [tt(configuration)] }),
  GetConfiguration: () => ({ PTZConfiguration: tt(configuration) }),
  GetStatus() {
    advance();
    const moving = (...axes) => (axes.some((each) => head[each].goal !== null || head[each].velocity) ? 'MOVING' : 'IDLE');
    const position = Object.fromEntries(Object.entries(head).map(([axis, { at }]) => [axis, toUnits(axis, at).toFixed(5)]));
    return {
      PTZStatus: tt({
        Position: {
          PanTilt: { attributes: { x: position.pan, y: position.tilt, space: POSITION } },
          Zoom: { attributes: { x: position.zoom, space: ZOOM } },
        },
        MoveStatus: { PanTilt: moving('pan', 'tilt'), Zoom: moving('zoom') },
        UtcTime: new Date().toISOString(),
      }),
    };
  },
  AbsoluteMove({ Position: { PanTilt, Zoom } }) {
    advance();
    if (PanTilt) {
      const [pan, tilt] = [number('pan', PanTilt, 'x', POSITION), number('tilt', PanTilt, 'y', POSITION)];
      go('pan', toValue('pan', pan));
      go('tilt', toValue('tilt', tilt));
    }
    if (Zoom) go('zoom', toValue('zoom', number('zoom', Zoom, 'x', ZOOM)));
    return {};
  },
  ContinuousMove({ Velocity: { PanTilt }, Timeout }) {
    advance();
    const until = now() + seconds(Timeout);
    if (PanTilt) {
      const [pan, tilt] = [number('pan', PanTilt, 'x', VELOCITY), number('tilt', PanTilt, 'y', VELOCITY)];
      run('pan', pan, until);
      run('tilt', tilt, until);
    }
    return {};
  },
  Stop({ PanTilt = true, Zoom = true }) {
    advance();
    const axes = [...(PanTilt ? ['pan', 'tilt'] : []), ...(Zoom ? ['zoom'] : [])];
    for (const axis of axes) Object.assign(head[axis], { goal: null, velocity: 0 });
    return {};
  },
};

const Media = {
  GetProfiles: () => ({
    Profiles: [tt({ attributes: { token: 'p0', fixed: true }, Name: 'main', PTZConfiguration: configuration })],
  }),
  GetSnapshotUri: () => ({
    MediaUri: tt({ Uri: `${base()}/snapshot.jpg`, InvalidAfterConnect: false, InvalidAfterReboot: false, Timeout: 'PT0S' }),
  }),
};

const PATHS = {
  'http://www.onvif.org/ver10/device/wsdl': '/onvif/device_service',
  'http://www.onvif.org/ver10/media/wsdl': '/onvif/media',
  'http://www.onvif.org/ver20/ptz/wsdl': '/onvif/ptz',
};

const Device = {
  GetSystemDateAndTime() {
    const time = new Date();
    const UTCDateTime = {
      Time: { Hour: time.getUTCHours(), Minute: time.getUTCMinutes(), Second: time.getUTCSeconds() },
      Date: { Year: time.getUTCFullYear(), Month: time.getUTCMonth() + 1, Day: time.getUTCDate() },
    };
    return { SystemDateAndTime: tt({ DateTimeType: 'NTP', DaylightSavings: false, UTCDateTime }) };
  },
  GetServices: () => ({
    Service: Object.entries(PATHS).map(([Namespace, path]) => ({
      Namespace, XAddr: base() + path, Version: tt({ Major: 2, Minor: 60 }),
    })),
  }),
};

// --- HTTP, and the password of WS-UsernameToken -----------------------------------------------------------------

const FREE = /<(\w+:)?(GetSystemDateAndTime|GetServices)[\s/>]/;
const http = createServer((request, response) => {
  if (request.url !== '/snapshot.jpg') return response.writeHead(404).end();
  const basic = `Basic ${Buffer.from(`${user}:${password}`).toString('base64')}`;
  if (request.headers.authorization !== basic) {
    return response.writeHead(401, { 'WWW-Authenticate': 'Basic realm="camera"' }).end();
  }
  advance();
  const shown = { pan: head.pan.at, tilt: head.tilt.at, zoom: head.zoom.at };
  print({ picture: shown });
  const comment = Buffer.from(JSON.stringify(shown));
  const segment = Buffer.from([0xff, 0xfe, 0, comment.length + 2]);
  const image = readFileSync(jpeg);
  return response.writeHead(200, { 'Content-Type': 'image/jpeg' })
    .end(Buffer.concat([image.subarray(0, 2), segment, comment, image.subarray(2)]));
});
const base = () => `http://127.0.0.1:${http.address().port}`;

function digest({ Nonce, Created }) {
  const nonce = Buffer.from(Nonce.$value ?? Nonce, 'base64');
  return createHash('sha1').update(nonce).update(Created.$value ?? Created).update(password).digest('base64');
}

function known(security) {
  const token = security?.UsernameToken;
  if (!token || token.Username !== user) return false;
  const age = Date.now() - Date.parse(token.Created.$value ?? token.Created);
  return Math.abs(age) < 10_000 && (token.Password.$value ?? token.Password) === digest(token);
}

http.listen(0, '127.0.0.1', async () => {
  const served = { devicemgmt: ['Device', Device], media: ['Media', Media], ptz: ['PTZ', PTZ] };
  await Promise.all(Object.entries(served).map(([file, [name, operations]]) => new Promise((resolve, reject) => {
    const uri = `${folder}/${file}.wsdl`;
    const xml = readFileSync(uri, 'utf8');
    const [, namespace] = /targetNamespace="([^"]+)"/.exec(xml);
    const server = soap.listen(http, {
      path: PATHS[namespace], services: { [`${name}Service`]: { [`${name}Port`]: operations } }, xml, uri,
      forceSoap12Headers: true,
      callback: (error) => (error ? reject(error) : resolve()),
    });
    let free = false;
    server.log = (type, data) => {
      if (type === 'received') free = FREE.test(data);
      if (type === 'received' || type === 'replied') print({ [type]: data });
    };
    server.authenticate = (security) => free || known(security);
  })));
  print({ port: http.address().port });
});
