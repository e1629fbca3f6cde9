"""A campaign on a graphics processor: varying values and noise are drawn there, by the same laws as here."""

import numpy as np
import pytest

from benchmarks.gpu_assembler import assembled
from quadstep.engines.gpu_sweep import ptx
from quadstep.io.errors import UserError
from quadstep.studies.campaign.flyer import DeviceFlyer, Flyer, device_flyer, generate, generated_batch
from quadstep.studies.campaign.schema import read_campaign
from tests.campaigns import NOISY, SHORT
from tests.fake_driver import installed
from tests.needs import PTXAS, needs

GENTLE = SHORT.replace("end = [0.4, 0.1, 0.2]", "end = [0.02, 0.005, 0.01]")
DRAWN = """
mission = "mission.toml"
seed = 5
precision = "{precision}"
[vary]
"vehicle.mass" = {{ type = "normal", mean = 1.0, deviation = 0.1, low = 0.7, high = 1.3 }}
"start.position.2" = {{ type = "uniform", low = -0.001, high = 0.001 }}
"disturbance.scale" = {{ type = "log-normal", median = 0.5, sigma = 0.5 }}
[[correlated]]
keys = ["start.position.0", "start.position.1"]
mean = [0.0, 0.001]
covariance = [[1e-6, 4e-7], [4e-7, 1e-6]]
"""
WINDY = """
mission = "mission.toml"
[vary]
"wind.mean.0" = { type = "uniform", low = 0.0, high = 5.0 }
"""


def written(folder, mission, campaign):
    (folder / "mission.toml").write_text(mission)
    (folder / "campaign.toml").write_text(campaign)
    return read_campaign(folder / "campaign.toml")


@pytest.mark.parametrize(("mission", "text"), [(SHORT, DRAWN.format(precision="f64")), (NOISY, WINDY)], ids=["paper", "real"])
def test_the_law_gives_what_the_host_has_drawn_noise_included(tmp_path, mission, text):
    flyer = Flyer(written(tmp_path, mission, text))
    batch = generated_batch(flyer)
    law, order = generate(flyer.campaign, flyer.planner, batch), np.argsort(batch.places)
    for flight in (0, 17, 255):
        np.testing.assert_array_equal(np.array(law(0.0, float(flight)), dtype=float), batch.rows[flight][order])


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_threads_that_draw_fly_as_lanes_do(tmp_path, monkeypatch, precision):
    driver = installed(monkeypatch)
    campaign = written(tmp_path, GENTLE, DRAWN.format(precision=precision))
    flyer = device_flyer(campaign)
    assert isinstance(flyer, DeviceFlyer)
    got, wanted = flyer.fly(3, 14), Flyer(campaign).fly(3, 14)
    assert got.schema == wanted.schema
    for name in wanted.column_names:
        ours, theirs = got[name], wanted[name]
        assert ours.to_pylist() == theirs.to_pylist(), name
    assert not driver.problems


@pytest.mark.parametrize("way", ['{ type = "sobol", low = 0.9, high = 1.1 }', '{ type = "choice", values = [0.9, 1.1] }'])
def test_what_cannot_be_drawn_there_is_drawn_here(tmp_path, monkeypatch, way):
    installed(monkeypatch)
    campaign = written(tmp_path, SHORT, f'mission = "mission.toml"\n[vary]\n"vehicle.mass" = {way}\n')
    flyer = device_flyer(campaign)
    assert not isinstance(flyer, DeviceFlyer)
    ours, theirs = (one.fly(0, 5)["position_rmse[m]"].to_numpy() for one in (flyer, Flyer(campaign)))
    np.testing.assert_array_equal(ours, theirs)


def test_values_that_cannot_be_flown_are_refused_there_too(tmp_path, monkeypatch):
    installed(monkeypatch)
    campaign = written(tmp_path, SHORT, DRAWN.format(precision="f64").replace("low = 0.7, high = 1.3", "high = 9.0"))
    flyer = device_flyer(campaign)
    flyer.fly(0, 4)
    campaign.file.vary["vehicle.mass"].__dict__["deviation"] = 100.0
    with pytest.raises(UserError, match=r"flight \d+ .*vehicle\.mass"):
        flyer.fly(0, 64)


@needs(PTXAS)
def test_the_program_that_draws_assembles(tmp_path):
    flyer = Flyer(written(tmp_path, SHORT, DRAWN.format(precision="f32")))
    batch = generated_batch(flyer)
    law = generate(flyer.campaign, flyer.planner, batch)
    text = ptx(batch.loop, batch.start, batch.parameters, frozenset(batch.places), generate=law)
    assert (assembled(text, 90).stores, assembled(text, 90).loads) == (0, 0)
