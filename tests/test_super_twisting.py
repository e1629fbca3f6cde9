"""A stranger's controller, written outside the package from the documents alone, in every command."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from quadstep import fly, read_mission
from quadstep.engines.engine import Engine
from quadstep.interfaces.controller import Measured
from quadstep.io.errors import UserError
from quadstep.io.places import Place
from quadstep.io.user_code import load
from quadstep.mission.own_controller import own_section
from quadstep.numbers import vector
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.rare.run_folder import opened
from tests.campaigns import no_report
from tests.commands import quadstep

pytestmark = pytest.mark.usefixtures("no_figures", "ungraded")

EXAMPLES = Path(__file__).parent.parent / "examples"
CAMPAIGN = """
mission = "super_twisting.toml"
flights = 32
[vary]
"controller.k_1" = { type = "uniform", low = 3.0, high = 6.0 }
"vehicle.mass" = { type = "uniform", low = 2.5, high = 2.7 }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The example, shortened."""
    folder = tmp_path_factory.mktemp("stranger")
    shutil.copy(EXAMPLES / "super_twisting.py", folder)
    text = (EXAMPLES / "super_twisting.toml").read_text()
    text = text.replace("[tune]", "[simulation]\nduration = 2.0\n\n[tune]\nconstraints = {}")
    (folder / "super_twisting.toml").write_text(text)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    return folder


def done(*arguments):
    run = quadstep(*arguments)
    assert run.code == 0, run.err
    return run


def test_the_example_holds_its_path_in_gusts(folder):
    done("fly", EXAMPLES / "super_twisting.toml", "--out", folder / "whole", "--require", "position_rmse=0.04")
    metrics = json.loads((folder / "whole" / "metrics.json").read_text())
    assert metrics["outcome"] == "completed"
    assert metrics["mission"]["controller"]["type"] == "super_twisting.py:SuperTwisting"
    page = (folder / "whole" / "page.html").read_text()
    assert '"label":"k_1"' in page
    assert "k_1 (x) " in page


def test_engines_agree_on_it(folder):
    plan = read_mission(folder / "super_twisting.toml").plan(folder)
    short = plan._replace(ticks=plan.ticks._replace(last=300))
    np.testing.assert_array_equal(fly(short, Engine.PYTHON).rows, fly(short).rows)


def test_campaigns_know_it_by_its_content(folder):
    campaign, out = folder / "campaign.toml", folder / "campaign"
    with no_report():
        done("campaign", campaign, "--out", out)
        done("campaign", campaign, "--out", out, "--resume")
    done("fly", campaign, "--flight", "3", "--results", out, "--out", folder / "third")
    law = folder / "super_twisting.py"
    text = law.read_text()
    law.write_text(text.replace("0.05, ", "0.06, "))
    run = quadstep("campaign", campaign, "--out", out, "--resume")
    law.write_text(text)
    assert run.refused
    assert "cannot be resumed: super_twisting.py has changed; choose another --out" in run.err


def test_what_is_not_continued_says_which_of_the_users_files_has_changed(folder, tmp_path):
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    law, other = tmp_path / "super_twisting.py", tmp_path / "constants.py"
    law.write_text(f"import constants  # noqa: F401\n{law.read_text()}")
    other.write_text("K = 1\n")
    mission, out = tmp_path / "super_twisting.toml", tmp_path / "out"
    axes = "--x", "controller.k_1=3:6:2", "--y", "controller.slope=1:2:2"
    commands = {
        "campaign": ("campaign", tmp_path / "campaign.toml"),
        "map": ("envelope", mission, *axes, "--flights", "2"),
        "tuned": ("tune", mission, "--budget", "480"),
    }
    with no_report():
        for name, command in commands.items():
            done(*command, "--out", out / name)
    toml = tmp_path / "campaign.toml"
    with opened(out / "rare", read_campaign(toml), resume=False, overwrite=False):
        pass

    def refused(said):
        for name, command in commands.items():
            run = quadstep(*command, "--out", out / name)
            assert run.refused
            assert said in run.err
        with pytest.raises(UserError, match=said), opened(out / "rare", read_campaign(toml), resume=True, overwrite=False):
            pass

    other.write_text("K = 1  # of no consequence\n")
    with opened(out / "rare", read_campaign(toml), resume=True, overwrite=False):
        pass
    other.write_text("K = 2\n")
    refused("constants.py has changed")
    law.write_text(f"{law.read_text()}L = 3\n")
    refused("constants.py and super_twisting.py have changed")
    run = quadstep("fly", tmp_path / "campaign.toml", "--flight", "3", "--results", out / "campaign", "--out", out / "third")
    assert "since constants.py and super_twisting.py have changed" in run.err


def test_it_is_mapped_tuned_and_flown_as_tuned(folder):
    mission = folder / "super_twisting.toml"
    done("envelope", mission, "--x", "controller.k_1=3:6:2", "--y", "controller.slope=1:2:2", "--flights", "4",
         "--out", folder / "map")  # fmt: skip
    assert (folder / "map" / "envelope.png").exists()
    done("tune", mission, "--budget", "480", "--out", folder / "tuned")
    assert (folder / "tuned" / "super_twisting.py").read_bytes() == (folder / "super_twisting.py").read_bytes()
    done("fly", folder / "tuned" / "tuned.toml", "--out", folder / "flown")


def test_new_missions_list_its_gains(folder):
    done("new", folder / "new.toml", "--controller", "super_twisting.py:SuperTwisting")
    text = (folder / "new.toml").read_text()
    assert 'type = "super_twisting.py:SuperTwisting"' in text
    assert "# k_1 = " in text
    assert "m^(1/2)/s^(3/2); gain of the root of s" in text
    done("fly", folder / "new.toml", "--out", folder / "newly")


def test_its_conditions_warn_and_its_certificate_is_refused(folder):
    weak = folder / "weak.toml"
    weak.write_text((folder / "super_twisting.toml").read_text().replace("k_1 = 4.0", "k_1 = [4.0, 1.0, 4.0]"))
    run = done("fly", weak, "--out", folder / "weak")
    assert "controller.k_1 (y) = 1 is not above 1.5 sqrt(L) = 1.5 (condition of Levant 1993)" in run.err
    run = quadstep("certify", weak, "--out", folder / "certificate")
    assert run.refused
    assert "SuperTwisting" in run.err


@pytest.mark.parametrize(("change", "said"), [
    (("k_1 = 4.0", "k_1 = -4.0"), "controller.k_1: every entry must be greater than 0"),
    (("k_1 = 4.0", "k_9 = 4.0"), "controller.k_9: unknown key; did you mean k_1? Allowed here: bound, inertia, k_1, k_2, k_R"),
    (("k_1 = 4.0", 'k_1 = "four"'), "controller.k_1: should be a number or a list of three, not 'four'"),
    (("py:SuperTwisting", "py:SuperTwister"), "has no 'SuperTwister'; it defines Gains, Memory"),
    (("super_twisting.py", "gone.py"), "gone.py: file not found"),
    (('preset = "research-2.6kg"', "mass = 1.0"), "provides a Measured; this one provides a State"),
])  # fmt: skip
def test_wrong_keys_are_one_line(folder, change, said):
    path = folder / "wrong.toml"
    text = (folder / "super_twisting.toml").read_text().replace(*change)
    path.write_text(text.partition("[wind]")[0] if "mass" in change[1] else text)
    run = quadstep("fly", path, "--out", folder / "wrong")
    assert run.refused, run
    assert said in run.err, run.err


def test_the_law_pushes_against_its_sliding_variable(folder):
    """s > 0 asks for a push along +x, and the integral part grows with its sign."""
    law = load(Place("super_twisting.py", "SuperTwisting"), folder)
    gains = law.gains(read_mission(folder / "super_twisting.toml").modelled.model())
    zero = vector(0.0, 0.0, 0.0)
    here = Measured(zero, zero, vector(1.0, 0.0, 0.0, 0.0), zero, 0.0, zero)
    reference = read_mission(folder / "super_twisting.toml").plan(folder).loop.path
    away = reference.reference(0.0, read_mission(folder / "super_twisting.toml").plan(folder).parameters.path)._replace(
        position=vector(1.0, 0.0, -1.0), velocity=zero, acceleration=zero
    )
    memory = law().guide(law().start(here, gains), here, away, gains, 0.0, 0.01)
    assert memory.force[0] > 0.0
    assert memory.integral[0] > 0.0
    assert memory.integral[2] < 0.0
    assert memory.force[2] < gains.mass * gains.gravity
    command, _ = law().law(memory, here, away, gains, 0.0, 0.002)
    assert command.torque[1] > 0.0  # the nose goes down towards +x
    assert own_section("super_twisting.py:SuperTwisting", Measured, folder).own
