// A log dropped on the page, or opened with a button.

import { Watched } from "../view/events";
import { byId, fill, h } from "../view/dom";
import { closed, count } from "../view/notation";
import { BadFile, type Log, pathOfLog } from "./log";
import { readLog } from "./read";

/** say: one line to the reader. */
export function listenToFiles(opened: Watched<Log | undefined>, say: (line: string) => void): void {
  const input = h("input", { type: "file", id: "log-file", accept: ".csv,.ulg,.ulog,.mcap,.txt", hidden: true, "aria-label": "A log to overlay on the flight", tabindex: -1 });
  const button = h("button", { type: "button", class: "plain", id: "open-log" }, "Open a log");
  button.addEventListener("click", () => input.click());
  input.addEventListener("change", () => {
    const file = input.files?.[0];
    if (file) void take(file);
    input.value = "";
  });
  byId("log-ways").append(button, input);
  const chip = h("span", { class: "chip", hidden: true });
  byId("log-ways").append(chip);
  opened.watch((log) => {
    chip.hidden = !log;
    if (!log) return;
    const away = h("button", { type: "button", class: "plain", "aria-label": `Take ${log.name} away` }, "✕");
    away.addEventListener("click", () => opened.set(undefined));
    fill(chip, h("span", {}, log.name), away);
  });

  const take = async (file: File): Promise<void> => {
    try {
      const log = readLog(file.name, await file.arrayBuffer());
      opened.set(log);
      say(`Opened ${log.name}: ${log.kind} with ${count(log.series.length, "signal")}, ${seconds(log)} s long. ${pathOfLog(log) ? "Its path is drawn in the scene; signals" : "Signals"} named like one of the flight’s columns are drawn with it, all others under “Choose and add plots”. For the stability margins of the loop that flew a log, use “quadstep advise”.`);
    } catch (error) {
      const why = error instanceof BadFile ? error.message : `${file.name.slice(0, 60)}: it may be damaged`;
      say(closed(`Could not open ${why}`));
    }
  };
  for (const kind of ["dragover", "dragenter"]) {
    document.addEventListener(kind, (event) => {
      if (![...((event as DragEvent).dataTransfer?.types ?? [])].includes("Files")) return;
      event.preventDefault();
      document.body.dataset["dropping"] = "yes";
    });
  }
  document.addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) delete document.body.dataset["dropping"];
  });
  document.addEventListener("drop", (event) => {
    delete document.body.dataset["dropping"];
    const file = event.dataTransfer?.files[0];
    if (!file) return;
    event.preventDefault();
    void take(file);
  });
}

function seconds(log: Log): string {
  return log.series.reduce((most, { times }) => Math.max(most, times[times.length - 1]!), 0).toFixed(1);
}
