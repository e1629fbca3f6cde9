// A client of the page's data, independent of its front end: flies what it is asked to and prints JSON.
// node page_client.cjs PAGE < requests; a request is {flight, controller, values: {control: [numbers]}, rows: bool, net: bool}.
const fs = require("node:fs");
const page = fs.readFileSync(process.argv[2], "utf8");
const inside = (id) => page.match(new RegExp(`<script id="${id}"[^>]*>([\\s\\S]*?)</script>`))[1];
const data = JSON.parse(inside("quadstep-data"));
new Function(inside("quadstep-laws"))();
const laws = globalThis.quadstepLaws;
const lawOf = (id) => (typeof laws[id] === "string" ? (laws[id] = (0, eval)(laws[id])) : laws[id]);
const resolve = (v) =>
  Array.isArray(v) ? v.map(resolve)
  : v && typeof v === "object" ? ("$" in v ? data.shared[v.$] : Object.fromEntries(Object.entries(v).map(([k, w]) => [k, resolve(w)])))
  : v;
const modules = globalThis.quadstepModules ?? {};
/** The same flight by WebAssembly, laid out in its memory here. */
const quick = (id, [parameters, tables, start, ticks, rows]) => {
  const end = 1 << 21, memory = new WebAssembly.Memory({ initial: 1024 });
  const stack = new WebAssembly.Global({ value: "i32", mutable: true }, end);
  const code = new WebAssembly.Module(Buffer.from(modules[id], "base64"));
  const { exports } = new WebAssembly.Instance(code, { env: { __linear_memory: memory, __stack_pointer: stack } });
  const given = [parameters, tables.flatMap((table) => [...table]), start];
  const places = [...given, rows, [0, 0]].reduce((so, one) => [...so, so.at(-1) + 8 * one.length], [end + 8 * ticks.every.length]);
  new BigInt64Array(memory.buffer, end, ticks.every.length).set(ticks.every.map(BigInt));
  given.forEach((one, i) => new Float64Array(memory.buffer, places[i], one.length).set(one));
  exports.fly(BigInt(ticks.last), BigInt(ticks.log), ticks.step, end, ...places.slice(0, 5));
  rows.set(new Float64Array(memory.buffer, places[3], rows.length));
  return [...new Float64Array(memory.buffer, places[4], 2)];
};
const flights = resolve(data.flights);
const doubles = (text) => {
  const bytes = Buffer.from(text, "base64");
  return new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
};
const answer = ({ flight: id, controller: which, values = {}, rows: wanted = true, net: seen = false }) => {
  const flight = flights.find((one) => one.id === id);
  const controller = flight.controllers[which ?? 0];
  const law = data.laws[controller.law];
  const parameters = doubles(data.presets[controller.preset]).slice();
  for (const [place, value] of controller.overrides) parameters[place] = Number(value);
  const start = Float64Array.from(controller.start, Number);
  const ticks = { ...flight.ticks };
  let duration = ticks.last * ticks.step;
  for (const control of [...flight.controls, ...controller.controls]) {
    control.components.forEach((component, number) => {
      const value = values[control.id]?.[number] ?? component.value;
      if (control.kind === "neurons") {
        law.neurons.slice(value).forEach((neuron) => neuron.parameters.forEach((place, i) => (parameters[place] = neuron.off[i])));
        return;
      }
      if (control.kind === "toggle" && value !== 0) return;
      for (const set of component.sets) {
        const plus = (a, b) => (b === 0 ? a : a + b);
        const change = plus(set.power === 1 ? Number(set.factor) * value : Number(set.factor) / value, Number(set.offset));
        const names = set.what === "parameter" ? law.names : law.starts;
        const array = set.what === "parameter" ? parameters : start;
        if (set.what === "duration") duration = set.add ? plus(duration, change) : change;
        else if (names.includes(set.name)) array[names.indexOf(set.name)] = set.add ? plus(array[names.indexOf(set.name)], change) : change;
      }
    });
  }
  ticks.last = Math.max(ticks.log, Math.round(duration / ticks.step));
  const rows = new Float64Array((Math.floor(ticks.last / ticks.log) + 1) * law.columns.length);
  const tables = controller.tables.map((name) => doubles(data.tables[name]));
  const net = seen ? new Float64Array((rows.length / law.columns.length) * (4 * law.net + 6)) : undefined;
  const code = lawOf(controller.law);
  const result = code.fly(parameters, tables, start, ticks, rows, net);
  const again = new Float64Array(rows.length);
  if (modules[controller.law]) code.run = (...given) => quick(controller.law, given);
  const other = code.run && code.fly(parameters, tables, start, ticks, again);
  code.run = undefined;
  const valid = result.rows * law.columns.length;
  return {
    ...result,
    quick: other && JSON.stringify(other) === JSON.stringify(result) && rows.slice(0, valid).every((value, i) => Object.is(value, again[i])),
    values: wanted ? Buffer.from(rows.buffer, 0, result.rows * law.columns.length * 8).toString("base64") : "",
    net: net ? Array.from(net) : [],
    columns: law.columns,
    names: law.names,
    parameters: Buffer.from(parameters.buffer).toString("base64"),
    start: Array.from(start),
    ticks,
  };
};
process.stdout.write(JSON.stringify(JSON.parse(fs.readFileSync(0, "utf8")).map(answer)));
