// A class's page: what changes follows without a reload, the table of gains is of the controller that the field names, a button
// puts a gain into the field or a link into the clipboard, and a submission that does not arrive leaves its text.
(() => {
  const by = id => document.getElementById(id), form = document.forms[0];
  let next = 0;
  const look = async () => {
    clearTimeout(next);
    if (!document.hidden) {
      try {
        const unfolded = [...document.querySelectorAll("details[open] > [id^=attempts]")].map(one => "unfolded=" + one.id.slice(9));
        const answer = await fetch("/live?" + unfolded.join("&"));
        if (answer.ok) {
          const fresh = new DOMParser().parseFromString(await answer.text(), "text/html");
          for (const part of fresh.body.children) {
            const shown = by(part.id);
            if (shown && shown.innerHTML !== part.innerHTML && !shown.contains(document.activeElement)) shown.innerHTML = part.innerHTML;
          }
        }
        if (by("answer")?.textContent === "Sent." && !document.querySelector("#said [data-waits]")) by("answer").textContent = "";
        by("offline").hidden = answer.ok || answer.status === 503;
      } catch { by("offline").hidden = false; }
    }
    next = setTimeout(look, document.querySelector("#said [data-waits]") ? 2000 : 10000);
  };
  form?.addEventListener("submit", async event => {
    event.preventDefault();
    by("refused")?.remove();
    by("answer").textContent = "Sending …";
    try {
      const answer = await fetch("/submit", { method: "POST", body: new URLSearchParams(new FormData(form)) });
      by("answer").textContent = answer.ok ? "Sent." : (await answer.text()).trim();
    } catch { by("answer").textContent = "Not sent: the class does not answer. Your text is still here."; }
    look();
  });
  const begin = (key, value) => {
    const field = by("text"), lines = field.value.split("\n"), named = line => line.replace(/^[#\s]+/, "").split("=")[0].trim() === key;
    let at = lines.findIndex(line => named(line) && !line.trim().startsWith("#"));
    if (at < 0) {
      at = lines.findIndex(named);
      if (at >= 0) lines[at] = lines[at].replace(/^[#\s]+/, "");
      else {
        at = lines.findIndex(line => line.trim() === "[controller]") + 1;
        lines.splice(at, 0, ...at ? [] : ["[controller]"], `${key} = ${value}`);
        if (!at) at = 1;
      }
      field.value = lines.join("\n");
    }
    const start = lines.slice(0, at).join("\n").length + 1 + lines[at].indexOf("=") + 2;
    field.focus();
    field.setSelectionRange(start, start + lines[at].split("=")[1].split("#")[0].trim().length);
  };
  const offer = () => {
    for (const code of document.querySelectorAll(".gains td code")) {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: "Change", onclick: () => begin(code.textContent, code.closest("tr").cells[1].textContent) });
      button.setAttribute("aria-label", `Change ${code.textContent}`);
      code.after(button);
    }
  };
  const laws = { [form?.dataset.law]: document.querySelector(".gains") };
  let all;
  const follow = async () => {
    const named = [...by("text").value.matchAll(/^\s*type\s*=\s*["']([\w-]+)["']/gm)].map(one => one[1]);
    if (named.some(one => one !== form.dataset.law)) all ??= new DOMParser().parseFromString(await (await fetch("/laws")).text(), "text/html");
    for (const one of named) laws[one] ??= all?.querySelector(`[id="${one}"] .gains`);
    const law = named.find(one => laws[one]) ?? form.dataset.law, shown = document.querySelector(".gains");
    if (shown === laws[law]) return;
    shown.replaceWith(laws[law]);
    for (const one of document.querySelectorAll("#gains, a[href='#gains']")) one.textContent = `Gains of the controller “${law}”`;
    if (!laws[law].querySelector("button")) offer();
  };
  if (form && by("gains")) {
    offer();
    by("text").addEventListener("input", () => follow().catch(() => {}));
    follow().catch(() => {});
  }
  for (const button of document.querySelectorAll("[data-link]")) {
    button.hidden = false;
    button.onclick = async () => {
      const lines = (await (await fetch("/links.csv")).text()).trim().split("\n"), line = lines[button.dataset.link];
      const held = Object.assign(document.createElement("textarea"), { value: line.slice(line.lastIndexOf(",") + 1) });
      button.after(held);
      held.select();
      const copied = document.execCommand("copy"); // navigator.clipboard needs https
      held.remove();
      button.textContent = copied ? "Copied" : "Not copied: take the table of links";
    };
  }
  document.addEventListener("visibilitychange", look);
  next = setTimeout(look, 2000);
})();
