// The guided walk: one step at a time, with its text, the one control to move and the one thing to watch.

import { type Card, card } from "../controls/card";
import type { Changes } from "../controls/changes";
import { choice } from "../controls/choices";
import type { Controller, StepData, StoryData } from "../data/contract";
import { controllerOf, controlsOf, valuesOf } from "../data/settings";
import type { Board } from "../plots/board";
import type { Session, Shown } from "../session";
import { byId, fill, h } from "../view/dom";
import { flat, rich } from "../view/notation";
import { Watched } from "../view/events";
import { question, succeeded, wanted, yet } from "./guess";

export class Guide {
  /** The step on the screen, from 0; undefined: nobody walks. */
  readonly at = new Watched<number | undefined>(undefined);
  private readonly slot = h("div", { class: "guide-control" });
  private readonly plot = h("div", { class: "guide-plot" });
  private readonly wide = matchMedia("(min-width: 1180px)"); // as frame.css has it
  private inline: HTMLElement | undefined;
  private readonly goal = h("p", { class: "guide-text guide-goal", role: "status" });
  private made: { card: Card; owner: Controller | undefined } | undefined;
  private key = "";
  private readonly right = new Map<number, boolean>(); // by step

  /** began: told each step as it is set up. */
  constructor(
    private readonly host: HTMLElement,
    private readonly story: StoryData,
    private readonly session: Session,
    private readonly changes: Changes,
    private readonly board: Board,
    private readonly began: (step: StepData) => void,
  ) {
    this.close();
    session.shown.watch((shown) => shown && this.follow(shown));
    this.wide.addEventListener("change", () => this.settle());
  }

  /** What is watched stands first among the plots where these are beside the walk, else in it. */
  private settle(): void {
    if (this.wide.matches) byId("chooser").before(this.plot);
    else this.inline?.append(this.plot);
  }

  get step(): StepData | undefined {
    return this.at.value === undefined ? undefined : this.story.steps[this.at.value];
  }

  /** Show a step as it was written; settings: false to leave the flight as it is. */
  open(place: number, settings = true): void {
    const step = this.story.steps[place];
    if (!step) return;
    this.at.set(place);
    document.body.dataset["walking"] = "yes";
    this.key = "";
    this.build(step, place);
    const { flight, controller, ghost, values } = step;
    this.session.begin({ flight, controller, ghost, values });
    if (settings) {
      this.session.apply({ flight, controller, ghost, values });
    } else if (this.session.shown.value) this.follow(this.session.shown.value);
    this.began(step);
  }

  close(): void {
    this.at.set(undefined);
    delete document.body.dataset["walking"];
    this.wait(false);
    this.session.begin();
    this.board.watch(undefined, this.plot);
    this.invite("New here?", "Start the walk", `“${this.story.title}”: in each step, move one control and watch one thing.`);
  }

  private invite(title: string, start: string, text: string, ...more: HTMLElement[]): void {
    const button = h("button", { type: "button", class: "primary", id: "guide-start" }, start);
    button.addEventListener("click", () => {
      this.right.clear();
      this.open(0);
      this.reveal();
    });
    fill(this.host, h("div", { class: "guide-card" }, h("h2", {}, title), h("p", {}, text, ...more), button));
  }

  /** The last step's flight as its file has it, how good the guesses were, and what there is besides. */
  private finish(): void {
    const guesses = [...this.right.values()];
    const { flight } = this.step!;
    this.close();
    this.session.select(flight);
    const beside = this.session.page.links.map(({ label, href }) => h("a", { href }, label)).flatMap((link) => [" ", link, "."]);
    const more = h("span", {}, "All sliders are yours now.", ...beside, " ", h("code", {}, "quadstep explain"), " writes an article that takes the proof apart. The ten lessons of the documentation begin with “Six motions, four inputs”; ", h("code", {}, "quadstep check"), " grades their exercises.");
    this.invite("The end of the walk", "Walk again", guesses.length ? `Right guesses: ${guesses.filter(Boolean).length} of ${guesses.length}. ` : "", more);
  }

  /** Until a guess is made nothing can be tried that answers it. */
  private wait(waiting: boolean): void {
    byId("waits").hidden = !waiting;
    byId("controls").inert = waiting;
  }

  private build(step: StepData, place: number): void {
    const last = this.story.steps.length - 1;
    let waiting = step.guess !== null;
    const flown = this.session.flight(step.flight)!;
    const button = (text: string, id: string, to: number | undefined): HTMLButtonElement => {
      const made = h("button", { type: "button", class: id === "guide-next" ? "primary" : "plain", id, disabled: to !== undefined && (to < 0 || to > last) }, text);
      made.addEventListener("click", () => {
        if (waiting && id !== "guide-leave" && to !== place - 1) return asked!.show();
        if (id === "guide-finish") this.finish();
        else if (to === undefined) this.close();
        else this.open(to);
        this.reveal();
      });
      return made;
    };
    const again = h("button", { type: "button", class: "plain", id: "guide-again" }, "Reset this step");
    again.addEventListener("click", () => this.open(place));
    const solve = h("button", { type: "button", class: "plain", id: "guide-solution" }, "Show a solution");
    const { flight, controller, ghost } = step;
    solve.addEventListener("click", () => this.session.apply({ flight, controller, ghost, values: { ...step.values, ...step.solution } }));
    const watch = (): void => this.board.watch(step.watch === "scene" ? undefined : step.watch, this.plot);
    const title = step.watch === "net" ? "Force of the net" : (flown.panels.find(({ id }) => id === step.watch)?.title ?? "");
    const inline = h("div", { hidden: step.watch === "scene" });
    this.inline = inline;
    this.settle();
    byId("plots").scrollTop = 0;
    const text = step.text.map((paragraph) => h("p", { class: "guide-text guide-said" }, ...rich(paragraph)));
    const trial = h(
      "div",
      { class: "guide-trial", hidden: step.guess !== null },
      ...(step.guess ? text : []), // which answers the guess
      h("h3", { class: "guide-what" }, "Move"),
      this.slot,
      wanted(step) ? this.goal : null,
      Object.keys(step.solution).length ? solve : null,
      step.watch === "scene" ? null : h("h3", { class: "guide-what" }, "Watch"),
      h("p", { class: "guide-text guide-where" }, step.watch === "scene" ? "The vehicle in the scene" : `“${flat(title)}”`, step.watch === "scene" ? null : h("span", { class: "guide-right" }, ", the first plot on the right"), step.look && `: ${step.look}`, "."),
      inline,
    );
    const guessed = (verdict: HTMLElement, right: boolean | undefined): void => {
      waiting = false;
      onward.textContent = place < last ? "Next" : "Finish";
      if (right !== undefined) this.right.set(place, right);
      trial.hidden = false;
      this.wait(false);
      watch();
      const { settings } = this.session.shown.value!;
      const { controller, values } = step.guess!;
      this.session.apply({ ...settings, controller, values: { ...settings.values, ...values } });
      this.began(step);
      this.reveal(verdict.parentElement!, verdict);
    };
    const asked = step.guess && question(step.guess, guessed);
    const onward = place < last ? button("Next", "guide-next", place + 1) : button("Finish", "guide-finish", undefined);
    if (waiting) onward.textContent = "Show me";
    fill(
      this.host,
      h("p", { class: "guide-place" }, h("span", {}, `Step ${place + 1} of ${last + 1}`), button("Leave the walk", "guide-leave", undefined)),
      h("progress", { max: last + 1, value: place + 1, "aria-label": "Progress of the walk" }),
      h("h2", { tabindex: -1 }, ...rich(step.title)),
      ...(step.guess ? [] : text),
      asked?.host,
      trial,
      h("div", { class: "guide-ways" }, button("Back", "guide-back", place - 1), again, onward),
    );
    this.wait(step.guess !== null);
    if (step.guess) this.board.watch(undefined, this.plot);
    else watch();
  }

  /** To the beginning of what is new; to the step's title where the scene stays above what scrolls, and must not cover it. */
  private reveal(begins = this.host, focused = this.host.querySelector<HTMLElement>("h2[tabindex], #guide-start")): void {
    const stage = byId("stage");
    const above = getComputedStyle(stage).position === "sticky";
    const to = above && begins !== this.host ? this.host.querySelector("h2")! : begins;
    to.style.scrollMarginTop = above ? `${stage.offsetHeight}px` : "";
    to.scrollIntoView({ block: above || begins === this.host ? "start" : "nearest" });
    focused?.focus({ preventScroll: true });
  }

  /** The control shows what is set, also where it was moved elsewhere. */
  private follow(shown: Shown): void {
    const { step } = this;
    if (!step) return;
    const { data, settings } = shown;
    if (wanted(step)) {
      const done = succeeded(step, shown);
      const wrong = done ? yet(shown) : "";
      fill(this.goal, done ? "✓ Done: " : "Goal: ", wanted(step), ".", wrong ? ` Problems remain: ${wrong}.` : "");
      this.goal.classList.toggle("done", done);
    }
    const key = `${data.id} ${settings.controller} ${settings.ghost}`;
    if (key !== this.key) {
      this.key = key;
      this.make(step, shown);
    }
    if (this.made) this.made.card.show(valuesOf(settings, this.made.card.control, this.made.owner));
  }

  private make(step: StepData, { data, settings }: Shown): void {
    this.made = undefined;
    const { move } = step;
    if (move === "controller" || move === "ghost") {
      fill(this.slot, choice(move, `guide-${move}`, data, settings, this.session, this.changes));
      return;
    }
    const found = controlsOf(data, controllerOf(data, settings.controller)).find(([control]) => control.id === move);
    if (!found) {
      fill(this.slot, h("p", { class: "quiet" }, "The current controller has no such control."));
      return;
    }
    const [control, owner] = found;
    const made = card(control, (which, values, final) => this.changes.moved(which, owner, values, final));
    this.made = { card: made, owner };
    fill(this.slot, made.element);
  }
}
