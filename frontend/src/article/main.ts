// The article: its figures made live.

import { startTheme, toggleTheme } from "../view/theme";
import { inversion } from "./figures/inversion";
import { lyapunov } from "./figures/lyapunov";
import { nested } from "./figures/nested";
import { net } from "./figures/net";
import { sliding } from "./figures/sliding";
import { startLighting } from "./lighting";

// Inside another page, a link to a figure shows that figure alone.
if (window.top !== window && location.hash) document.documentElement.dataset["alone"] = "";
startTheme();
document.getElementById("theme")?.addEventListener("click", toggleTheme);
startLighting();
nested();
sliding();
inversion();
net();
lyapunov();
document.documentElement.dataset["ready"] = "yes";
