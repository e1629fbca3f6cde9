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
  const result = lawOf(controller.law).fly(parameters, tables, start, ticks, rows, net);
  return {
    ...result,
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
