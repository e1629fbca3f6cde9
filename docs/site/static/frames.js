// A page that flies inside this one says how high it is, and is told whether this one is dark or light.
const frames = () => [...document.querySelectorAll("iframe.flying")];
const tell = (frame) => frame.contentWindow.postMessage({ theme: document.body.dataset.theme || "auto" }, "*");
addEventListener("message", ({ data, source }) => {
  const frame = frames().find((one) => one.contentWindow === source);
  if (!frame || !(data?.height > 0)) return;
  frame.style.height = `${Math.min(data.height, 4000) + 2}px`; // and its border
  tell(frame);
});
// The drawn figures take the dark or light colours of colours.css, which go by the theme of the root.
const night = matchMedia("(prefers-color-scheme: dark)");
const turn = () => {
  const { theme } = document.body.dataset;
  document.documentElement.dataset.theme = theme === "dark" || (theme !== "light" && night.matches) ? "dark" : "light";
  frames().forEach(tell);
};
night.addEventListener("change", turn);
addEventListener("DOMContentLoaded", () => {
  turn();
  new MutationObserver(turn).observe(document.body, { attributeFilter: ["data-theme"] });
});
