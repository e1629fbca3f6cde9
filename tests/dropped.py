"""Files dropped on a page, as a browser would hand them over."""

import base64

DROP = """
async (name, content) => {
  const bytes = Uint8Array.from(atob(content), (one) => one.charCodeAt(0));
  const carried = new DataTransfer();
  carried.items.add(new File([bytes], name));
  const notice = document.getElementById("notice");
  notice.hidden = true;
  const told = (kind) => document.getElementById("stage").dispatchEvent(
    new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer: carried }));
  if (told("dragenter") || told("dragover") || !document.body.dataset.dropping) throw new Error("is not taken");
  if (told("drop") || document.body.dataset.dropping) throw new Error("is not dropped");
  while (notice.hidden) await new Promise((done) => setTimeout(done, 20));
  return notice.querySelector("span").textContent;
}
"""
"""Drags a file over the page and lets it go; what the page says of it. The page has to tell the browser each time that it
takes the file: otherwise the browser would open it in the page's place."""


def carried(name: str, content: bytes) -> tuple[str, str]:
    """The arguments of `DROP`."""
    return name, base64.b64encode(content).decode()
