// The list of results: search, order, compare two. Without it the list stands as it is.
(() => {
  const by = id => document.getElementById(id), list = by("cards"), cards = [...list.children];
  document.body.classList.add("scripted");
  const fields = ["search", "kind", "order"], first = { search: "", kind: "", order: "newest" };
  const orders = {
    newest: (a, b) => b.dataset.changed - a.dataset.changed,
    name: (a, b) => a.dataset.name.localeCompare(b.dataset.name),
    error: (a, b) => (a.dataset.rmse || Infinity) - (b.dataset.rmse || Infinity),
    folder: (a, b) => a.dataset.place.localeCompare(b.dataset.place),
  };
  const show = () => {
    const words = by("search").value.toLowerCase().split(/\s+/).filter(Boolean), kind = by("kind").value;
    let shown = 0;
    for (const card of cards) {
      const text = card.textContent.toLowerCase();
      card.hidden = !(words.every(word => text.includes(word)) && (!kind || kind === card.dataset.kind));
      shown += !card.hidden;
    }
    list.append(...cards.sort(orders[by("order").value]));
    by("count").textContent = shown === cards.length ? `${shown} results` : `${shown} of ${cards.length} results`;
    by("all").hidden = shown > 0;
    const asked = new URLSearchParams(location.search);
    for (const id of fields) by(id).value === first[id] ? asked.delete(id) : asked.set(id, by(id).value);
    history.replaceState(null, "", `${location.pathname}${asked.size ? `?${asked}` : ""}`);
  };
  const picked = [];
  list.addEventListener("change", event => {
    const place = event.target.value;
    if (event.target.checked) picked.push(place); else picked.splice(picked.indexOf(place), 1);
    if (picked.length > 2) list.querySelector(`input[value="${CSS.escape(picked.shift())}"]`).checked = false;
    const chosen = picked.map(one => cards.find(card => card.dataset.place === one).dataset), kind = chosen[0]?.kind;
    for (const box of list.querySelectorAll("input")) {
      const other = kind && box.closest("li").dataset.kind !== kind;
      box.disabled = other;
      box.nextSibling.textContent = other ? ` not a ${kind.toLowerCase()}: cannot be compared with it` : " compare";
    }
    const [a, b] = picked.map(encodeURIComponent), together = by("together");
    together.hidden = !picked.length;
    if (b) together.href = `/compare?a=${a}&b=${b}`; else together.removeAttribute("href");
    together.textContent = b ? `Compare “${chosen[0].name}” and “${chosen[1].name}”` : picked.length ? `“${chosen[0].name}”: tick another to compare` : "";
  });
  for (const id of fields) by(id).addEventListener("input", show);
  const restore = asked => {
    for (const id of fields) by(id).value = asked.get(id) ?? first[id];
    show();
  };
  by("all").addEventListener("click", () => restore(new URLSearchParams()));
  addEventListener("pageshow", () => restore(new URLSearchParams(location.search))); // also where the browser goes back to it
})();
