"""A guided walk over a page's flights, read from Markdown: `docs/story.md` says how one is written."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, BeforeValidator, Field

from quadstep.io import files
from quadstep.io.documents import parse_toml
from quadstep.io.errors import UserError, unknown_name
from quadstep.mission.check import check
from quadstep.mission.fields import Section
from quadstep.page.laws import Laws
from quadstep.page.model import Control, FlightData, GuessView, StepView, StoryView

OWN = Path(__file__).parent / "stories" / "paper.md"
"""The walk that ships, on the paper's page."""

MOST_STEPS = 40
NET, SCENE = "net", "scene"
"""What may be watched beside plots: the first net, and the vehicle itself."""

FILE = "file"
"""As a ghost: the same controller with the file's values."""

CHOICES = ("controller", "ghost")
"""What may be moved beside sliders."""


def as_values(value: object) -> object:
    """What a control may be set to. Raises ValueError."""
    parts = value if isinstance(value, list) else [value]
    if not all(isinstance(one, bool | int | float) and abs(one) < math.inf for one in parts):
        raise ValueError(f"should be a number, true or false, or a list of numbers, not {value!r:.60}")
    return value


def as_bounds(bounds: list[float]) -> list[float]:
    """The lowest value that counts, and the highest if there is one. Raises ValueError."""
    return bounds if len(bounds) == 1 and 0.0 < bounds[0] < math.inf else as_range(bounds)


def as_range(bounds: list[float]) -> list[float]:
    """Two values that count or a stretch of time, the lower first. Raises ValueError."""
    if len(bounds) != 2 or not 0.0 <= bounds[0] < bounds[1] < math.inf:
        raise ValueError(f"should be two numbers, 0 or more, the larger one last, not {bounds!r:.60}")
    return bounds


Measure = Literal["rmse", "largest", "tilt"]
"""What success may ask for: RMSE and largest error of the position [m], largest tilt [rad]."""

Values = Annotated[bool | float | list[float], BeforeValidator(as_values)]


class Guess(Section):
    """A question before the step's flight. answer: one of choices. controller, show: flown once somebody guessed."""

    ask: Annotated[str, Field(min_length=1, max_length=300)]
    choices: Annotated[list[Annotated[str, Field(min_length=1, max_length=80)]], Field(min_length=2, max_length=5)]
    answer: str
    controller: str | None = None
    show: dict[str, Values] = Field(default_factory=dict)

    def model_post_init(self, context: object) -> None:
        """The answer is one of unlike choices. Raises ValueError."""
        if len(set(self.choices)) < len(self.choices):
            raise ValueError("choices: should all be different")
        if self.answer not in self.choices:
            raise ValueError(f"answer: {self.answer!r:.60} is not one of {', '.join(self.choices)}")


class Settings(Section):
    """The table of one step."""

    flight: str | None = None
    mission: str | None = None
    controller: str | None = None
    ghost: str = ""
    set: dict[str, Values] = Field(default_factory=dict)
    move: str
    watch: str
    look: Annotated[str, Field(max_length=120)] = ""
    time: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] | None = None
    window: Annotated[list[float], AfterValidator(as_range)] | None = None
    camera: Annotated[str, Field(pattern="^(orbit|follow)$")] = "orbit"
    guess: Guess | None = None
    success: dict[Measure, Annotated[list[float], AfterValidator(as_bounds)]] = Field(default_factory=dict)
    as_commanded: bool = False
    solution: dict[str, Values] = Field(default_factory=dict)


class StoryStep(NamedTuple):
    """One step as it was written. text: its paragraphs."""

    title: str
    text: tuple[str, ...]
    settings: Settings


class Story(NamedTuple):
    """A walk. source: its file."""

    title: str
    source: Path
    steps: tuple[StoryStep, ...]

    @property
    def missions(self) -> list[Path]:
        """The mission files that its steps name, each once."""
        named = (step.settings.mission for step in self.steps)
        return [self.source.parent / name for name in dict.fromkeys(named) if name is not None]

    @property
    def of_others(self) -> bool:
        """Whether a step shows a flight that the page has of itself."""
        return any(step.settings.mission is None for step in self.steps)


def read_story(path: Path) -> Story:
    """The walk in a Markdown file. Raises UserError naming file, step and what is allowed."""
    text = files.read_text(path, files.STORY)
    head, *parts = re.split(r"^##[ \t]+(?=\S)", text, flags=re.MULTILINE)
    title = re.match(r"\s*#[ \t]+(.*\S)", head)
    if not title:
        raise UserError(f"{path}: should start with a title: # Title of the walk")
    if not 1 <= len(parts) <= MOST_STEPS:
        raise UserError(f"{path}: has {len(parts)} steps; 1 to {MOST_STEPS} are allowed, each under a heading: ## Title")
    return Story(title[1], path, tuple(step(part, place, path) for place, part in enumerate(parts, 1)))


def step(part: str, place: int, path: Path) -> StoryStep:
    """One step, from its heading on. Raises UserError."""
    title, _, body = part.partition("\n")
    where = f"{path}: step {place} ({title.strip():.40})"
    fences = re.findall(r"^```toml[ \t]*\n(.*?)^```[ \t]*$", body, flags=re.MULTILINE | re.DOTALL)
    if len(fences) != 1:
        raise UserError(f"{where}: has {len(fences)} settings; each step needs exactly one block that starts with ```toml")
    settings = check(Settings, parse_toml(fences[0], where), where, path.parent)
    if (settings.flight is None) == (settings.mission is None):
        raise UserError(f"{where}: give either flight (one of the page's) or mission (a file in the same folder)")
    if settings.mission is not None and not (path.parent / settings.mission).is_file():
        raise UserError(f"{where}: mission: {settings.mission!r:.60}: no such file next to {path.name}")
    prose = re.sub(r"^```.*?^```[ \t]*$", "", body, flags=re.MULTILINE | re.DOTALL)
    text = tuple(" ".join(one.split()) for one in re.split(r"\n\s*\n", prose) if one.strip())
    if not text:
        raise UserError(f"{where}: has no text; write two or three sentences below its settings")
    return StoryStep(title.strip(), text, settings)


def story_view(story: Story, flights: Sequence[FlightData], of_missions: Mapping[Path, str], laws: Laws) -> StoryView:
    """The walk as the page takes it. of_missions: ids of the flights of its mission files. laws: of the page.

    Raises UserError where a step names what the page does not have.
    """
    by_id = {flight.id: flight for flight in flights}
    steps = []
    for place, written in enumerate(story.steps, 1):
        where, settings = f"{story.source}: step {place} ({written.title:.40})", written.settings
        known = settings.flight if settings.mission is None else of_missions[story.source.parent / settings.mission]
        flight = by_id[chosen(known, by_id, f"{where}: flight")]
        steps.append(step_view(written, flight, where, laws))
    return StoryView(story.title, tuple(steps))


def step_view(written: StoryStep, flight: FlightData, where: str, laws: Laws) -> StepView:
    """A step on its flight. Raises UserError."""
    title, text, settings = written
    if not flight.controllers:
        raise UserError(f"{where}: {flight.name}: {flight.whyNot}")
    shared = {one.id: (one, "") for one in flight.controls}
    owned = {law.id: shared | {one.id: (one, f"{law.id}.") for one in law.controls} for law in flight.controllers}
    controller = chosen(settings.controller or flight.controllers[0].id, owned, f"{where}: controller")
    ghost = settings.ghost and chosen(settings.ghost, [FILE, *owned], f"{where}: ghost")

    def placed(table: Mapping[str, Values], key: str, flier: str = controller) -> dict[str, list[float]]:
        some, found = owned[flier], {}
        for name, given in table.items():
            control, owner = some[chosen(name, some, f"{where}: {key}")]
            found[f"{owner}{name}"] = components(control, given, f"{where}: {key}.{name}")
        return found

    values = placed(settings.set, "set")
    guess, asked = settings.guess, None
    if guess is not None:
        flier = chosen(guess.controller or controller, owned, f"{where}: guess.controller")
        answer, shown = guess.choices.index(guess.answer), placed(guess.show, "guess.show", flier)
        asked = GuessView(guess.ask, guess.choices, answer, flier, shown)
    moved = chosen(settings.move, [*CHOICES, *owned[controller]], f"{where}: move")
    net = [NET for law in flight.controllers if law.id == controller and laws.laws[law.law].net > 0]
    watched = chosen(settings.watch, [SCENE, *net, *(panel.id for panel in flight.panels)], f"{where}: watch")
    return StepView(
        title, text, flight.id, controller, ghost, values, moved, watched, settings.look, settings.time, settings.window,
        settings.camera,
        asked, {str(name): span for name, span in settings.success.items()}, settings.as_commanded,
        placed(settings.solution, "solution"),
    )  # fmt: skip


def components(control: Control, values: Values, where: str) -> list[float]:
    """A value for each component; one stands for all. Raises UserError."""
    count = len(control.components)
    found = [float(one) for one in (values if isinstance(values, list) else [values] * count)]
    if len(found) != count:
        raise UserError(f"{where}: should be one number or {count}, not {len(found)}")
    outside = [one for one in found if not control.low <= one <= control.high]
    if outside:
        raise UserError(f"{where}: {outside[0]:g} is outside {control.low:g} to {control.high:g}")
    return found


def chosen(name: str | None, allowed: Collection[str], where: str) -> str:
    """The name, if it is one of those allowed. Raises UserError naming these."""
    if name is None or name not in allowed:
        raise UserError(f"{where}: {unknown_name('value', name, allowed)}")
    return name
