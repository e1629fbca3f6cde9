// The article: its figures made live.

import { embed } from "../view/embedded";
import { links } from "../view/links";
import { startTheme, toggleTheme } from "../view/theme";
import { data } from "./data";
import { inversion } from "./figures/inversion";
import { lyapunov } from "./figures/lyapunov";
import { nested } from "./figures/nested";
import { net } from "./figures/net";
import { sliding } from "./figures/sliding";
import { startLighting } from "./lighting";

// Inside another page, `?figure=nested` shows that figure alone, and tells the page around it how high it is. (A fragment would scroll that page.)
const alone = document.getElementById(new URLSearchParams(location.search).get("figure") ?? "");
if (window.top !== window && alone) {
  document.documentElement.dataset["alone"] = "";
  alone.classList.add("alone");
}
startTheme();
embed(alone ?? document.body);
document.getElementById("theme")?.addEventListener("click", toggleTheme);
links(document.getElementById("links")!, data.links ?? []);
startLighting();
nested();
sliding();
inversion();
net();
lyapunov();
document.documentElement.dataset["ready"] = "yes";
