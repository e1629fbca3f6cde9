// A log that is dropped on the list, or chosen: the server reads it, and says where its advice is, or why it carries none.
(() => {
  const input = document.getElementById("log"), said = document.getElementById("said");
  document.body.classList.add("scripted");
  const send = async file => {
    said.textContent = `Reading ${file.name} …`;
    try {
      const answer = await fetch(`/advise/${encodeURIComponent(file.name)}`, { method: "POST", body: file });
      const text = (await answer.text()).trim();
      if (answer.status === 201) location.assign(text);
      else said.textContent = text;
    } catch {
      said.textContent = `${file.name} could not be sent: the server has ended, the log is too large, or another one is being read.`;
    }
  };
  input.addEventListener("change", () => input.files[0] && send(input.files[0]));
  for (const kind of ["dragover", "drop"]) {
    document.addEventListener(kind, event => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      if (kind === "drop" && event.dataTransfer.files[0]) send(event.dataTransfer.files[0]);
    });
  }
})();
