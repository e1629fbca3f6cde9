// A page that flies inside this one says how high it is, and is told whether this one is dark or light.
const frames = () => [...document.querySelectorAll("iframe.flying")];
const tell = (frame) => frame.contentWindow.postMessage({ theme: document.body.dataset.theme || "auto" }, "*");
addEventListener("message", ({ data, source }) => {
  const frame = frames().find((one) => one.contentWindow === source);
  if (!frame || !(data?.height > 0)) return;
  frame.style.height = `${Math.min(data.height, 4000) + 2}px`; // and its border
  tell(frame);
});
addEventListener("DOMContentLoaded", () =>
  new MutationObserver(() => frames().forEach(tell)).observe(document.body, { attributeFilter: ["data-theme"] }));
