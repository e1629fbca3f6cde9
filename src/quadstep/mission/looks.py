"""What one of the user's TOML files looks like, so that a command that takes another kind says which one takes this."""

from collections.abc import Mapping

from quadstep.io.errors import UserError

MISSION, CAMPAIGN, STUDY = "mission", "campaign", "study"

HINTS = {
    (CAMPAIGN, MISSION): "`quadstep campaign` flies it, `quadstep fly` with --flight N one of its flights",
    (STUDY, MISSION): "`quadstep compare` takes it",
    (MISSION, CAMPAIGN): 'a campaign names one: mission = "FILE.toml"',
    (STUDY, CAMPAIGN): "`quadstep compare` takes it",
    (MISSION, STUDY): "name two or more missions, or a study with tables [paths], [scenarios] and [controllers]",
    (CAMPAIGN, STUDY): "a study has tables [paths], [scenarios] and [controllers]",
}
"""What to do with a file that looks like the first where the second is wanted."""


def look(content: Mapping[str, object]) -> str:
    """What parsed TOML looks like; empty if like none of these."""
    of_mission = {"path", "controller", "vehicle"} & content.keys()
    if "mission" in content:
        return "" if "path" in content else CAMPAIGN
    if {"paths", "scenarios", "controllers"} & content.keys() and not of_mission:
        return STUDY
    return MISSION if of_mission else ""


def refuse_others(content: Mapping[str, object], wanted: str, source: str, hint: str = "") -> None:
    """Raises UserError for content that looks like something else than wanted. hint: instead of that in `HINTS`."""
    found = look(content)
    if found and found != wanted:
        raise UserError(f"{source}: looks like a {found}, not a {wanted}; {hint or HINTS[found, wanted]}")
