// A page that flies inside this one says how high it is.
addEventListener("message", ({ data, source }) => {
  for (const frame of document.querySelectorAll("iframe.flying"))
    if (frame.contentWindow === source && data?.height > 0) frame.style.height = `${Math.min(data.height, 4000) + 2}px`; // and its border
});
