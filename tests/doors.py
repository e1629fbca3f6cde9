"""All doors of the package."""

from quadstep.commands.cli import COMMANDS
from quadstep.engines.engine import FLOWN_BY
from quadstep.export.run import TARGETS
from quadstep.identify.logs.read import READERS
from quadstep.mission.own_controller import AUTOPILOTS
from quadstep.report.panels import FIGURES

DOORS = (COMMANDS, TARGETS, READERS, AUTOPILOTS, FIGURES, *FLOWN_BY.values())
