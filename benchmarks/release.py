"""Builds wheel and source archive, and tries the wheel with each extra in a new environment: `make release`.

Nothing of the checkout is there where it is tried but the archive. `python -m benchmarks.release campaign` tries one extra.
"""

import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
DIST = ROOT / "dist"

MISSION = """
[vehicle]
preset = "research-2.6kg"
[path]
type = "step"
end = [0.0, 0.0, 1.0]
duration = 2.0
[controller]
type = "{controller}"
"""
CAMPAIGN = 'mission = "mission.toml"\nflights = 16\n[vary]\nvehicle.mass = { type = "uniform", low = 2.5, high = 2.7 }\n'

FLOWN = (("--version",), ("fly", "mission.toml"), ("page", "mission.toml"))
TRIED: dict[str, tuple[tuple[str, ...], ...]] = {
    "": (*FLOWN, ("export", "mission.toml"), ("certify", "paper.toml"), ("new", "new.toml")),
    "campaign": (("campaign", "campaign.toml"),),
    "cluster": (("--version",),),
    "verify": (("verify", "--only", "24"),),
    "raptor": (("fly", "raptor.toml"),),
}
"""What is run of each extra; of the others, that its packages can be imported."""

IMPORTED = {
    "pandas": "pandas", "mavlink": "pymavlink", "mcap": "mcap, mcap_ros2", "rotorpy": "rotorpy",
    "notebook": "notebook", "cluster": "ray, pyarrow",
}  # fmt: skip
"""What is imported of each extra."""


def built() -> Path:
    """The wheel, built from the source archive as an index would; both are in dist/."""
    shutil.rmtree(DIST, ignore_errors=True)
    DIST.mkdir()
    backend = "from hatchling.build import build_{0}; print(build_{0}({1!r}))"
    subprocess.run([sys.executable, "-c", backend.format("sdist", str(DIST))], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    (archive,) = DIST.glob("*.tar.gz")
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(archive) as packed:
            packed.extractall(folder, filter="data")
        (source,) = Path(folder).iterdir()
        build = [sys.executable, "-c", backend.format("wheel", str(DIST))]
        subprocess.run(build, cwd=source, check=True, stdout=subprocess.DEVNULL)
    (wheel,) = DIST.glob("*.whl")
    return wheel


def extras() -> list[str]:
    """The core, and every extra."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return ["", *project["optional-dependencies"]]


def environment(folder: Path, wheel: Path, extra: str) -> Path:
    """A new environment with the wheel and an extra; its folder of programs."""
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    wanted = f"{wheel}[{extra}]" if extra else str(wheel)
    install = [str(programs / "python"), "-m", "pip", "--disable-pip-version-check", "install", "--quiet", wanted]
    subprocess.run(install, check=True)
    return programs


def tried(wheel: Path, extra: str) -> str:
    """Tries an extra; what went wrong, or nothing."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "work"
        folder.mkdir()
        for name, controller in (("mission.toml", "pid"), ("raptor.toml", "raptor")):
            text = MISSION.format(controller=controller)
            more = "[simulation]\ncontrol_period = 0.01\n" if controller == "raptor" else ""
            (folder / name).write_text(text + more, encoding="utf-8")
        (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
        (folder / "paper.toml").write_text('[path]\ntype = "minimum-jerk"\nend = [1.0, 0.0, 1.0]\nduration = 2.0\n')
        try:
            programs = environment(Path(place) / "environment", wheel, extra)
        except subprocess.CalledProcessError as error:
            return f"pip: exit code {error.returncode}"
        clean = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
        runs = [[str(programs / "quadstep"), *arguments] for arguments in TRIED.get(extra, ())]
        if extra in IMPORTED:
            runs.append([str(programs / "python"), "-c", f"import quadstep, {IMPORTED[extra]}"])
        for run in runs:
            done = subprocess.run(run, cwd=folder, env=clean, capture_output=True, text=True, check=False)
            if done.returncode:
                return f"{' '.join(run[1:])}: exit code {done.returncode}: {done.stderr.strip()[-500:]}"
    return ""


def main() -> None:
    """Build, try, say."""
    wheel = built()
    for path in sorted(DIST.iterdir()):
        print(f"dist/{path.name}: {path.stat().st_size / 1e6:.2f} MB")
    failed = False
    for extra in sys.argv[1:] or extras():
        wrong = tried(wheel, extra)
        failed |= bool(wrong)
        print(f"{extra or 'core'}: {wrong or 'installs and runs'}", flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
