// A class's page: the board and what is said follow without a reload, and a submission that does not arrive leaves its text.
(() => {
  const by = id => document.getElementById(id), form = document.forms[0];
  let next = 0;
  const look = async () => {
    clearTimeout(next);
    if (!document.hidden) {
      try {
        const answer = await fetch("/live");
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
      by("answer").textContent = answer.ok ? "Sent." : "Not taken: " + (await answer.text()).trim();
    } catch { by("answer").textContent = "Not sent: the class does not answer. Your text is still here."; }
    look();
  });
  document.addEventListener("visibilitychange", look);
  next = setTimeout(look, 2000);
})();
