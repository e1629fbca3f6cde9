"""The study that comes with the package, and the gains that it found."""

from importlib.resources import as_file, files

from quadstep.studies.comparison.study import Study, read_study

STUDY = "controllers.toml"


def shipped_study() -> Study:
    """It. Raises UserError where a file of the user's own is in the way."""
    with as_file(files("quadstep.studies.comparison") / "studies") as folder:
        return read_study(folder / STUDY)
