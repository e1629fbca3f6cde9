"""`quadstep serve`: a list, its flights, and nothing else of this machine."""

import base64
import errno
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from html import unescape
from itertools import pairwise
from pathlib import Path
from urllib.parse import quote
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from quadstep.engines.engine import Engine
from quadstep.io.errors import UserError
from quadstep.metrics.registry import AT_REST, REPORTED
from quadstep.page import build
from quadstep.page.answers import answer
from quadstep.page.comparison import conditions, row, words
from quadstep.page.folder import manifest, names_files, open_result, plan_again, read_log, results
from quadstep.page.serve import server
from quadstep.page.sharing import Access, access, qr_drawing, qr_text
from quadstep.page.thumbnails import short
from quadstep.proofs.prove.report import ProofVerdict, VerdictKind, write_report
from quadstep.report.drawing import FigureJob
from quadstep.report.markup import Fact, disclosure, heading, page_text, summary, table
from quadstep.report.panel import Panel
from quadstep.report.sheet import Sheet, sheet
from quadstep.studies.advise import advise, advise_dropped
from quadstep.studies.fly import fly_mission
from tests.commands import heeding_interrupts
from tests.made_logs import excited as in_ardupilots_log
from tests.made_logs import looped
from tests.pages import STAND_IN, data_of, serving
from tests.patience import PATIENCE

MISSION = """
name = "A <b>bold</b> name & more"
path = { type = "minimum-jerk", end = [0.0, 0.0, 1.0], duration = 1.0 }
"""
SVG = "{http://www.w3.org/2000/svg}"
SECRET = "a secret beside the folder"


@pytest.fixture(scope="module", autouse=True)
def stand_in():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "template", lambda: STAND_IN)
        yield


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """out/ with a flight, a report and links, beside a secret."""
    top = tmp_path_factory.mktemp("top")
    (top / "secret.txt").write_text(SECRET)
    (top / "secret").mkdir()
    (top / "secret" / "flight.csv").write_text(SECRET)
    out = top / "out"
    mission = top / "mission.toml"
    mission.write_text(MISSION)
    fly_mission(mission, out / "first flight", Engine.LANES, False)
    (out / "report").mkdir()
    (out / "report" / "report.html").write_text("<p>campaign</p>")
    (out / "report" / "chart.png").write_bytes(b"\x89PNG")
    (out / ".hidden").mkdir()
    (out / ".hidden" / "report.html").write_text("concealed")
    (out / "link.txt").symlink_to(top / "secret.txt")
    (out / "inside.html").symlink_to(out / "report" / "report.html")
    (out / "way").symlink_to(top / "secret")
    (out / "up").symlink_to("..")
    os.mkfifo(out / "report" / "pipe.txt")
    return out


@pytest.fixture(scope="module")
def port(root):
    with serving(server(root, 0)) as where:
        yield where


def get(port, path, host=None, method="GET", headers=None):
    """Status, headers and content of a request sent as it stands."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
    for name, value in {"Host": f"127.0.0.1:{port}" if host is None else host, **(headers or {})}.items():
        if value:
            connection.putheader(name, value)
    connection.endheaders()
    response = connection.getresponse()
    content = response.read()
    connection.close()
    return response.status, dict(response.getheaders()), content.decode("utf-8", "replace")


def test_the_list_names_every_result_and_escapes_it(port):
    status, headers, text = get(port, "/")
    assert status == 200
    assert "A &lt;b&gt;bold&lt;/b&gt; name &amp; more" in text
    assert "<b>bold" not in text
    assert "flew 1\u00a0s" in text
    assert 'href="/files/report/report.html"' in text
    assert "/.hidden" not in text
    assert "secret" not in text
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["X-Content-Type-Options"] == "nosniff"


def test_every_link_of_the_list_opens(port):
    _, _, text = get(port, "/")
    links = [part.split('"')[0] for part in text.split('href="/')[1:]]
    assert len(links) > 4
    assert all(get(port, f"/{link}")[0] == 200 for link in links)


def test_a_flight_is_flown_live_from_its_metrics(port, root):
    status, _, text = get(port, "/fly/first%20flight/")
    assert status == 200
    (flight,) = data_of(text)["flights"]
    assert flight["name"] == "A <b>bold</b> name & more"
    assert flight["whyNot"] == ""
    assert len(flight["controllers"]) == 3
    assert flight["outcome"]["text"] == "completed 1 s"
    assert data_of(text)["links"] == [{"label": "All results", "href": "/"}]
    page = data_of((root / "first flight" / "page.html").read_text())["flights"][0]
    assert page["controllers"] == flight["controllers"]


@pytest.mark.parametrize(("path", "kind"), [("report.html", "text/html; charset=utf-8"), ("chart.png", "image/png")])
def test_files_are_sent_with_their_kind(port, path, kind):
    status, headers, content = get(port, f"/files/report/{path}")
    assert (status, headers["Content-Type"]) == (200, kind)
    assert int(headers["Content-Length"]) > 3
    assert "; sandbox allow-scripts" in headers["Content-Security-Policy"]
    assert content
    status, headers, content = get(port, f"/files/report/{path}", method="HEAD")
    assert (status, content) == (200, "")


LISTED = r"""
/files/../secret.txt /files/%2e%2e/secret.txt /files/%2E./secret.txt /files/..%2fsecret.txt /files/..%5csecret.txt
/../secret.txt /files/%252e%252e/secret.txt /files/report/../../secret.txt /files/report/%2e%2e/%2e%2e/secret.txt
 /files/....//secret.txt
/files//etc/passwd /files/%2fetc%2fpasswd /files///etc/passwd //etc/passwd file:///etc/passwd * /nothing /files/a%ff /files/%00
/files/link.txt /files/inside.html /files/way/flight.csv /files/up/secret.txt /files/up/out/report/report.html
/fly/way/ /fly/../secret/ /fly/%2e%2e/secret/ /fly/up/secret /fly/ /fly/report/ /fly/report/report.html
/files/.hidden/report.html /files/%2ehidden/report.html /files/report/pipe.txt /files/report /files/ /files
/files/report/report.html%00.txt /files/\..\secret.txt http://127.0.0.1/files/../secret.txt
"""
OUTSIDE = [*LISTED.split(), "/files/" + "x" * 5000, "/files/" + "a/" * 3000]


@pytest.mark.parametrize("path", OUTSIDE)
def test_nothing_outside_the_folder_is_sent(port, path):
    status, _, content = get(port, path)
    assert status in (400, 404, 414)
    assert SECRET not in content
    assert "root:" not in content
    assert "concealed" not in content


PARTS = r"""
.. . %2e %2f %5c / \ %00 secret.txt secret out up way report link.txt flight.csv %252e report.html ~ files fly ? # ; %c0%ae ..;
"""
PIECES = st.sampled_from(PARTS.split())


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(["/files/", "/fly/", "/", ""]), st.lists(PIECES, max_size=8))
def test_no_mixture_of_paths_leads_outside(root, start, pieces):
    found = answer(root, start + "".join(pieces))
    content = found.text
    if found.file is not None:
        place = Path(f"/proc/self/fd/{found.file.fileno()}").resolve() if Path("/proc/self/fd").exists() else root
        with found.file as file:
            content += file.read().decode("utf-8", "replace")
        assert place == root or root in place.parents
    assert SECRET not in content


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "127.0.0.1:1", "localhost:1", "", "[::1]", "127.0.0.1 "]
)
def test_another_host_gets_nothing(port, host):
    status, _, content = get(port, "/", host=host.replace("PORT", str(port)))
    assert status == 421
    assert "A &lt;b&gt;" not in content


def test_localhost_is_this_host_and_two_hosts_are_none(port):
    assert get(port, "/", host=f"localhost:{port}")[0] == 200
    assert get(port, "/", host=f"LOCALHOST:{port}")[0] == 200
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as line:
        line.sendall(f"GET / HTTP/1.0\r\nHost: 127.0.0.1:{port}\r\nHost: evil.example\r\n\r\n".encode())
        assert b" 421 " in line.recv(100)


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "CONNECT"])
def test_other_methods_are_refused(port, method):
    assert get(port, "/", method=method)[0] in (405, 501)


def send(port, name, content, **headers):
    """Status and answer to a log that is sent as the list sends it."""
    host = f"127.0.0.1:{port}"
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    connection.request(
        "POST", f"/advise/{quote(name, safe='')}", content, {"Host": host, "Origin": f"http://{host}", **headers}
    )
    response = connection.getresponse()
    said = response.read().decode()
    connection.close()
    return response.status, said


def test_a_log_that_is_dropped_on_the_list_gives_the_advice_of_the_command(tmp_path):
    content = in_ardupilots_log(*looped(), {"ATC_RAT_RLL_P": 0.2, "ATC_RAT_RLL_I": 0.3, "ATC_RAT_RLL_D": 0.01})
    log = tmp_path / "my flight.bin"
    log.write_bytes(content)
    root = tmp_path / "results"
    root.mkdir()
    with serving(server(root, 0, advise=advise_dropped)) as port:
        status, address = send(port, log.name, content)
        assert status == 201
        folder = re.fullmatch(r"/files/(my_flight-[0-9a-f]{8}-advise)/report\.html", address)[1]
        assert get(port, address)[0] == 200
        told, asked = (advise(log, None, None, tmp_path / "out", True, sheet("svg")).record, manifest(root / folder))
        assert {name: asked[name] for name in ("crossover[rad/s]", "phase_margin[rad]", "changes")} == {
            name: told[name] for name in ("crossover[rad/s]", "phase_margin[rad]", "changes")
        }
        assert asked["log"] == "my_flight.bin"
        for name, sent, said in (
            ("empty.ulg", b"", "empty.ulg: is empty"), ("../../x.bin", bytes(5000), "cannot be read as an ArduPilot log"),
            ("a.csv", b"1", "should be the vehicle's own log"), (".." * 40, b"1", "should be the vehicle's own log"),
        ):  # fmt: skip
            status, answered = send(port, name, sent)
            assert status == 422
            assert said in answered
            assert answered.count("\n") == 1
            assert "quadstep-log-" not in answered
        assert [one.name for one in root.iterdir()] == [folder]
        assert send(port, log.name, content) == (201, address)
        other = in_ardupilots_log(*looped(), {"ATC_RAT_RLL_P": 0.3, "ATC_RAT_RLL_I": 0.3, "ATC_RAT_RLL_D": 0.01})
        assert send(port, log.name, other)[1] != address  # of another log by the same name
        assert sum(one.name.startswith("my_flight") for one in root.iterdir()) == 2


DROP = """content => {
  const given = new DataTransfer();
  given.items.add(new File([Uint8Array.from(atob(content), one => one.charCodeAt(0))], "dropped.bin"));
  document.dispatchEvent(new DragEvent("drop", { dataTransfer: given, bubbles: true, cancelable: true }));
}"""


def test_the_list_opens_the_advice_of_a_log_or_says_the_line_that_refuses_it(tmp_path, browsers):
    page = browsers[False].page()
    with serving(server(tmp_path, 0, advise=advise_dropped)) as port:
        page.goto(f"http://127.0.0.1:{port}/")
        page.set_input_files("#log", {"name": "empty.ulg", "mimeType": "", "buffer": b""})
        page.locator("#said", has_text="empty.ulg: is empty").wait_for()
        content = in_ardupilots_log(*looped(), {"ATC_RAT_RLL_P": 0.2, "ATC_RAT_RLL_I": 0.3, "ATC_RAT_RLL_D": 0.01})
        page.evaluate(DROP, base64.b64encode(content).decode())
        page.wait_for_url("**/files/dropped-*-advise/report.html")
        assert "phase margin" in page.inner_text("main, body")


def test_only_this_machines_list_sends_logs_and_none_without_end(root, port):
    host = f"127.0.0.1:{port}"
    assert send(port, "a.bin", b"1") == (405, "Nothing can be sent here.\n")  # of a server that gives no advice
    with serving(server(root, 0, advise=advise_dropped)) as other:
        for headers, status in (
            ({"Origin": "http://evil.example"}, 403), ({"Origin": "null"}, 403), ({"Origin": f"http://{host}"}, 403),
            ({"Host": "evil.example", "Origin": "http://evil.example"}, 421), ({"Content-Length": "400000001"}, 413),
        ):  # fmt: skip
            assert send(other, "a.bin", b"1", **headers)[0] == status
        own = {"Origin": f"http://127.0.0.1:{other}"}
        assert get(other, "/advise/a.bin", method="POST", headers=own)[0] == 411
        assert get(other, "/elsewhere", method="POST", headers=own)[0] == 405
        assert "connect-src 'self'" in get(other, "/")[1]["Content-Security-Policy"]
        assert "connect-src" not in get(other, "/files/report/report.html")[1]["Content-Security-Policy"]


def test_it_listens_on_this_machine_only(root):
    running = server(root, 0)
    try:
        assert running.socket.getsockname()[0] == "127.0.0.1"
    finally:
        running.server_close()


def test_a_port_in_use_and_a_folder_that_is_none_are_one_line(root, port):
    with pytest.raises(UserError, match=rf"port {port} .*{os.strerror(errno.EADDRINUSE)}"):
        server(root, port)
    with pytest.raises(UserError, match="not a folder"):
        server(root / "nowhere", 0)
    with pytest.raises(UserError, match="is not a folder with results"):
        server(root / ("x" * 300), 0)
    with pytest.raises(UserError, match="not a folder"):
        server(root / "report" / "report.html", 0)


def test_a_browser_that_hangs_up_harms_nobody(port):
    for _ in range(5):
        with socket.create_connection(("127.0.0.1", port)) as line:
            line.sendall(b"GET / HT")
    assert get(port, "/")[0] == 200


def spoilt(folder, **content):
    folder.mkdir()
    (folder / "metrics.json").write_text(json.dumps(content))
    (folder / "flight.csv").write_text("t[s],x[m],y[m],z[m]\n0.0,1.0,2.0,3.0\n0.1,1.0,2.0,nan\n0.2,1.0,2.0,3.5\n")
    return folder


BASE = {"name": "x", "outcome": "completed", "ended[s]": 0.2}
LINE = {"type": "minimum-jerk", "end": [0.0, 0.0, 1.0], "duration": 1.0}


@pytest.mark.parametrize(("content", "why"), [
    ({}, "does not say how it was flown"),
    ({"mission": 3}, "does not say"),
    ({"mission": {"path": {"type": "recorded", "file": "/etc/passwd"}}}, "needs further files"),
    ({"mission": {"path": LINE, "controller": {"type": "backstepping", "nets": {"weights": "../w.json"}}}}, "further files"),
    ({"mission": {"path": LINE, "vehicle": {"file": "/etc/passwd"}}}, "further files"),
    ({"mission": {"path": LINE, "bogus": 1}}, "unknown key"),
    ({"mission": {"path": {**LINE, "duration": 1e9}}}, "duration"),
    ({"name": 3, "outcome": 5, "ended[s]": "soon", "warnings": 3, "position": 7, "u": []}, "does not say"),
    ({"outcome": "nonsense", "warnings": [1, "two"]}, "does not say"),
])  # fmt: skip
def test_a_result_that_cannot_be_flown_again_shows_its_recording(tmp_path, content, why):
    folder = spoilt(tmp_path / "result", **{**BASE, **content})
    (flight,) = data_of(open_result(folder))["flights"]
    assert why in flight["whyNot"]
    assert flight["recorded"]["count"] == 2  # the row that is no row is left out
    assert flight["recorded"]["columns"][3] == ["z", "m"]
    assert flight["outcome"]["code"] == 0


CSV = ["", "t[s]\n", "t,x,y\n1,2,3\n", "t,x,y,z\n1,2,3\n", "t,x,y,z\n1,2,3,four\n", "t,t,x,y,z\n1,1,1,1,1\n", "\0"]


@pytest.mark.parametrize("text", CSV)
def test_a_csv_that_is_no_flight_is_one_line(tmp_path, text):
    folder = spoilt(tmp_path / "result", **BASE)
    (folder / "flight.csv").write_text(text)
    with pytest.raises(UserError, match=r"flight\.csv: is not a flight"):
        open_result(folder)
    found = answer(tmp_path, "/fly/result")
    assert (found.status, found.text.count("is not a flight.csv")) == (422, 1)


def test_a_flight_lost_at_once_is_shown_without_rows(tmp_path):
    folder = spoilt(tmp_path / "result", **{**BASE, "outcome": "off_path", "ended[s]": 0.0})
    (folder / "flight.csv").write_text("t[s],x[m],y[m],z[m]\n\n")
    (flight,) = data_of(open_result(folder))["flights"]
    assert flight["outcome"]["text"].startswith("lost at 0 s: too far from its path")
    assert flight["recorded"]["count"] == 0


@pytest.mark.parametrize("name", ["metrics.json", "flight.csv"])
def test_a_link_in_a_result_is_not_followed(tmp_path, name):
    (tmp_path / "root").mkdir()
    folder = spoilt(tmp_path / "root" / "out", **BASE)
    outside = spoilt(tmp_path / "outside", **{**BASE, "name": SECRET})
    (folder / name).unlink()
    (folder / name).symlink_to(outside / name)
    for target in ("/", "/fly/", "/fly/."):
        assert SECRET not in answer(folder.parent, target).text
    found = answer(folder.parent, "/fly/out/")
    assert found.status == (404 if name == "flight.csv" else 200)
    assert SECRET not in found.text


def test_a_log_reads_back_exactly(root):
    log = read_log(root / "first flight" / "flight.csv", 0, 1.0)
    assert log.columns["psi_dot"] == "rad/s"
    assert log.rows.shape == (101, len(log.columns))
    assert np.allclose(log.column("t"), np.arange(101) * 0.01)


@pytest.mark.parametrize("text", ["[]", "{", "3", "\0", "[" * 100_000, '{"name": "\\ud800"}'])
def test_a_spoilt_manifest_is_an_empty_one_or_harmless(tmp_path, text):
    (tmp_path / "metrics.json").write_text(text)
    assert isinstance(manifest(tmp_path), dict)
    assert answer(tmp_path, "/").status == 200
    assert answer(tmp_path, "/").text.encode("utf-8", "replace")


def test_a_mission_of_absurd_depth_is_no_flight(tmp_path):
    content = {}
    for _ in range(5000):
        content = {"path": [content]}
    assert plan_again(content) == (None, None, "its metrics.json does not describe a flight")
    folder = spoilt(tmp_path / "deep", **BASE)
    (folder / "metrics.json").write_text('{"mission": ' + '{"path": [' * 450 + "]}" * 450 + "}")
    assert open_result(folder)


def test_files_named_deep_inside_are_found():
    assert names_files({"a": [{"b": {"file": "x"}}]})
    assert not names_files({"a": [{"b": {"file": None, "weights": None}}]})


def test_results_are_found_in_order_and_not_without_end(tmp_path):
    for name in ("b", "a/c", "a/b/c/d/e/f/g/h"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "report.html").write_text("x")
    assert [result.place.as_posix() for result in results(tmp_path)] == ["a/c", "b"]
    assert results(tmp_path / "b")[0].place == Path()


def test_names_of_folders_are_escaped_and_quoted(tmp_path):
    name = 'a <i> & "q" ?x=1#y %41 é'
    (tmp_path / name).mkdir()
    (tmp_path / name / "report.html").write_text("found")
    text = answer(tmp_path, "/").text
    assert "<i>" not in text
    assert f"/files/{quote(name)}/report.html" in text
    found = answer(tmp_path, f"/files/{quote(name)}/report.html")
    with found.file as file:
        assert file.read() == b"found"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly_when_told_to(root, number):
    running = subprocess.Popen(
        [sys.executable, "-m", "quadstep", "serve", str(root), "--port", "0"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"},
        preexec_fn=heeding_interrupts,  # noqa: PLW1509 (set before any thread of the child)
    )  # fmt: skip
    line = running.stdout.readline()
    address = line.split("http://")[1].split("/")[0]
    port = int(address.rpartition(":")[2])
    assert get(port, "/")[0] == 200
    time.sleep(0.1)
    running.send_signal(number)
    out, errors = running.communicate(timeout=PATIENCE)
    assert (running.returncode, out, errors) == (0, "Stopped.\n", "")


@pytest.mark.parametrize(
    "text", ['{"ended[s]": %s, "outcome": "completed"}' % ("9" * 400), '{"position_rmse[m]": 1e308}', "[" * 10**5]
)
def test_one_absurd_result_leaves_the_list_standing(tmp_path, text):
    (tmp_path / "absurd").mkdir()
    (tmp_path / "absurd" / "metrics.json").write_text(text, encoding="utf-8")
    (tmp_path / "good").mkdir()
    (tmp_path / "good" / "report.html").write_text("<p>good</p>", encoding="utf-8")
    os.utime(tmp_path / "good" / "report.html", (1e11, 1e11))
    listed = answer(tmp_path, "/")
    assert listed.status == 200
    assert "/files/absurd/metrics.json" in listed.text
    assert "/files/good/report.html" in listed.text


@pytest.mark.parametrize("line", [b"GET http://[/ HTTP/1.1", b"GET //[ HTTP/1.1", b"GET http://[::1/ HTTP/1.0"])
def test_an_address_that_is_none_is_answered(port, line, capfd):
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as one:
        one.sendall(line + f"\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode())
        assert one.makefile("rb").readline().startswith((b"HTTP/1.0 404", b"HTTP/1.1 404"))
    assert not capfd.readouterr().err


# Two results beside each other


def test_no_word_of_a_number_is_written_twice():
    assert words("largest_weight_norm.norm_W1") == "largest weight norm W1"
    assert words("position.x.rmse[m]") == "x error, RMSE"
    assert words("attitude.psi.error_settling[s]") == "yaw error, settling time"
    assert words("tau_phi.largest[N m]") == "roll torque, largest"
    assert words("rotors.least[N]") == "least thrust of a rotor"
    log_metrics = [name for one in REPORTED for name in one.full_names({"x": "m", "norm_W1": "-", "rotors": "N"})]
    for said in map(words, log_metrics):
        assert not any(first == second for first, second in pairwise(said.split())), said


def test_two_flights_are_compared_number_by_number_and_flown_in_one_page(port, root):
    status, _, text = get(port, "/compare?a=first%20flight&b=report")
    assert status == 422
    said = r"<p>first flight \(flight\) and report \([a-z ]+\) cannot be compared: choose two results of one kind</p>"
    assert re.search(said, text) and '<a href="/">All results</a>' in text
    status, _, text = get(port, "/compare?a=first%20flight&b=first%20flight")
    assert (status, "<p>first flight cannot be compared with itself.</p>" in text) == (422, True)
    status, _, text = get(port, "/compare?a=first%20flight&b=first%20fl<i>ght")
    assert (status, "<p>No result “first fl&lt;i&gt;ght” here.</p>" in text) == (404, True)
    status, _, text = get(port, "/both?a=first%20flight&b=first%20flight")
    assert status == 200
    first, second = data_of(text)["flights"]
    assert first["id"] != second["id"]
    assert get(port, "/both?a=first%20flight&b=report")[0] == 404
    for query in ("a=nowhere&b=report", "a=..&b=report", "a=way&b=report", "", "a=&b=", "a=%00&b=report"):
        assert get(port, f"/compare?{query}")[0] == 404, query


def test_of_two_the_closer_one_is_named(tmp_path):
    for name, rmse in (("near", 0.01), ("far", 0.03)):
        spoilt(tmp_path / name, name=name, **{"position_rmse[m]": rmse})
    text = answer(tmp_path, "/compare?a=far&b=near").text
    assert "“near” is 3.0 times closer to its path than “far”, by position RMSE over the whole flight." in text
    assert "10.0\u00a0mm" in text and "second / first" in text


def test_of_two_whose_errors_look_the_same_none_is_called_closer(tmp_path):
    for name, rmse in (("a", 0.07404), ("b", 0.07403), ("c", 0.0755)):
        spoilt(tmp_path / name, name=name, outcome="completed", **{"ended[s]": 0.2, "position_rmse[m]": rmse})
        rows = "".join(f"{0.1 * i},{rmse},0,1,0,0,1\n" for i in range(3))
        (tmp_path / name / "flight.csv").write_text("t[s],x[m],y[m],z[m],x_d[m],y_d[m],z_d[m]\n" + rows)
    text = answer(tmp_path, "/compare?a=a&b=b").text
    assert "Both are equally close to their paths." in text and "of the time" not in text
    text = answer(tmp_path, "/compare?a=a&b=c").text.replace("\N{NO-BREAK SPACE}", " ")
    assert "“a” is closer to its path than “c”, by position RMSE" in text, "1.02 would be 1.0 times closer"
    assert "“a” is the closer one 100 % of the time." in text


def test_of_two_reports_whose_missions_are_only_named_nothing_is_said_to_be_the_same(tmp_path):
    for name, law in (("a", "geometric"), ("b", "backstepping")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "metrics.json").write_text(json.dumps({"mission": f"{name}.toml", "controller": law}))
        (tmp_path / name / "report.html").write_text(page_text(name, [summary("The loop is sound.")], "linear"))
    text = plain(answer(tmp_path, "/compare?a=a&b=b").text)
    assert "“a” and “b” are not ranked. " in text and "Same vehicle" not in text


@pytest.mark.parametrize("key", ["controller", "controller.type"])
def test_a_campaign_that_draws_its_controller_names_all_that_fly(tmp_path, key):
    laws = ["pid", "geometric"] if key == "controller.type" else [{"type": "pid", "mass": 2.6}, {"type": "geometric"}]
    for name, vary in (("a", {key: {"type": "choice", "values": laws}}), ("b", {})):
        spoilt(tmp_path / name, name=name, vary=vary, mission={"controller": {"type": "pid", "k_x": len(vary)}})
    text = plain(answer(tmp_path, "/compare?a=a&b=b").text)
    assert "controller pid or geometric pid" in text and "k_x" not in text


def test_rows_of_a_table_that_three_columns_tell_apart_are_all_compared(tmp_path):
    for name, median in (("a", "60 mm"), ("b", "62 mm")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "metrics.json").write_text("{}")
        rows = [("on", "RMSE", "50 %", median), ("on", "RMSE", "90 %", "107 mm"), ("off", "RMSE", "50 %", "155 mm")]
        distances = table(("nets", "metric", "share below", "value"), rows)
        checks = table(("", "measured"), [("share", "100 %" if name == "a" else "–"), ("size", median)])
        parts = [summary("An answer."), heading("Distance", "d"), distances, heading("Checks", "c"), checks]
        (tmp_path / name / "report.html").write_text(page_text(name, parts, "campaign"))
    text = plain(answer(tmp_path, "/compare?a=a&b=b").text)
    assert "Distance a b on, RMSE, 50 % 60 mm 62 mm Checks a b share 100 % – size 60 mm 62 mm" in text
    assert "–: that report gives no value." in text


def plain(text):
    """A page's words, a blank for each mark and non-breaking blank."""
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]*>", " ", text)))


def test_of_two_campaigns_the_numbers_that_their_reports_begin_with_stand_beside_each_other(tmp_path):
    for name, share in (("a", "61 %"), ("b", "75 %")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "campaign.json").write_text("{}")
        facts = [Fact("succeed", share, "95 % interval: 48 % to 83 %")]
        facts += [Fact("median position RMSE", "185 mm")] * (name == "a")
        page = page_text(name, [summary("An answer.", facts)], "campaign")
        (tmp_path / name / "report.html").write_text(page)
    text = plain(answer(tmp_path, "/compare?a=a&b=b").text)
    assert "“a” and “b” are not ranked. " in text
    assert "succeed 61 % (95 % interval: 48 % to 83 %) 75 % (95 % interval: 48 % to 83 %)" in text
    assert "median position RMSE 185 mm –" in text
    for name in ("a", "b"):
        (tmp_path / name / "report.html").write_text(page_text(name, [summary("An answer.")], "campaign"))
    text = plain(answer(tmp_path, "/compare?a=a&b=b").text)
    assert "“a” and “b” are not ranked. " in text
    assert "answer An answer. An answer." in text


def test_of_two_campaigns_it_is_said_why_they_are_not_ranked_and_no_picture_has_axes_of_its_own(tmp_path):
    for name, preset, limit in (("a", "x500", 0.3), ("b", "crazyflie", 0.5)):
        (tmp_path / name / "figures").mkdir(parents=True)
        (tmp_path / name / "figures" / "distributions.svg").write_text("<svg></svg>")
        told = {"mission": {"vehicle": preset, "events": []}, "failure": {"position_rmse": limit}}
        told |= {"summary": {AT_REST: {"grade": "fragile" if name == "a" else "sound"}}}
        (tmp_path / name / "campaign.json").write_text(json.dumps(told))
        (tmp_path / name / "report.html").write_text(page_text(name, [summary("An answer.")], "Campaign"))
    text = answer(tmp_path, "/compare?a=a&b=b").text
    assert "“a” and “b” are not ranked, because their vehicles and limits differ." in text
    assert "loop at rest fragile sound" in plain(text)
    assert "<img" not in text and '<a href="/files/a/report.html">a</a>' in text
    alike = {"mission": {"vehicle": "x500"}, "failure": {"position_rmse": 0.3}}
    (tmp_path / "b" / "campaign.json").write_text(json.dumps(alike))
    assert "“a” and “b” are not ranked.</p>" in answer(tmp_path, "/compare?a=a&b=b").text, "an empty list is none"


OTHERS = {
    "vehicles": {"mission": {"vehicle": "crazyflie"}}, "simulations": {"mission": {"simulation": {"duration": 5.0}}},
    "scored times": {"mission": {"score_from": 5.0}},
    "winds (none; 3\u00a0m/s)": {"mission": {"wind": {"mean": [3.0, 0.0, 0.0]}}},
    "vehicles and paths": {"mission": {"vehicle": "crazyflie", "path": {"type": "step"}, "score_from": 5.0}},
    "limits": {"failure": {"position_rmse": 0.3}}, "variations": {"campaign": "[vary]\nvehicle.mass = 1", "chunks": []},
}  # fmt: skip


@pytest.mark.parametrize("other", [*OTHERS, ""])
def test_of_two_campaigns_only_the_controllers_are_said_to_differ_where_nothing_else_does(tmp_path, other):
    """Whatever else differs is the reason why they are not ranked, and a controller is none."""
    for name, law in (("a", "geometric"), ("b", "pid")):
        told = {
            "mission": {"vehicle": "x500", "controller": {"type": law}},
            "campaign": "[vary]\nvehicle.mass = 2",
            "chunks": [],
        }
        more = OTHERS.get(other, {}) if name == "b" else {}
        told |= {**more, "mission": {**told["mission"], **more.get("mission", {})}}
        (tmp_path / name).mkdir()
        (tmp_path / name / "campaign.json").write_text(json.dumps(told))
        (tmp_path / name / "report.html").write_text(page_text(name, [summary(f"{name} % succeeded. More.")], "Campaign"))
    text = plain(answer(tmp_path, "/compare?a=a&b=b").text)
    if other:
        assert f"“a” and “b” are not ranked, because their {plain(other)} differ. " in text
    else:
        said = "Same vehicle, path, air and limits; the controllers or their gains differ. “a”: a % succeeded. “b”: b % "
        assert said in text


def test_two_reports_of_a_kind_are_compared_by_the_values_of_their_tables_and_not_by_their_json(tmp_path):
    for name, gain, delay in (("a", "2.5", "51.7"), ("b", "7.25", "23.8")):
        (tmp_path / name).mkdir()
        content = {"name": name, "grade": "sound", "tuned": {"controller.k_x": float(gain)}, "seed": 1}
        (tmp_path / name / "metrics.json").write_text(json.dumps(content))
        gains = table(("gain", "current", "tuned", ""), [("K_r1 [N s/m]", "3.0", gain, ""), ("k_v", "3.0", "3.0", "")])
        only = ("pitch", "41", "43") if name == "a" else ("thrust", "70", "90")
        loops = table(("", "phase [°]", "delay [ms]"), [("roll", "44.7", delay), ("yaw", "50", "60"), only])
        flights = table(("flight", "RMSE"), [("17", f"{gain} m"), (f"{gain} of them", "1 m")])
        own = disclosure("Where it was flown", table((), [("mission", f"{name}.toml")]))
        parts = [heading("The gains", "g"), gains, heading("Margins", "m"), loops, heading("Flights", "f"), flights, own]
        page = page_text(name, [summary(f"Answer {name}.", [Fact("succeed", f"{gain} %")]), *parts], "tuning")
        (tmp_path / name / "report.html").write_text(page)
    text = answer(tmp_path, "/compare?a=a&b=b").text
    assert "<td>K<sub>r1</sub> [N s/m]: tuned</td><td>2.5</td><td>7.25</td>" in text.replace("\N{NO-BREAK SPACE}", " ")
    told = plain(text.split("What their reports say first</h2>")[1])
    assert "answer Answer a. Answer b. loop at rest sound sound succeed 2.5 % 7.25 %" in told
    alone = "pitch: phase [°] 41 – pitch: delay [ms] 43 – thrust: phase [°] – 70 thrust: delay [ms] – 90"
    assert f"Margins a b roll: delay [ms] 51.7 23.8 {alone}" in told and "Where it was flown a b mission a.toml b.toml" in told
    assert not any(one in told for one in ("k_v", "yaw", "17", "seed", "k_x", "of them", "second / first"))
    assert '<b class="good"><span aria-hidden="true">✓</span> loop sound</b>' in answer(tmp_path, "/").text


def test_of_two_flights_by_one_controller_the_gains_that_differ_are_told(tmp_path):
    law = {"k_x": [9.0, 9.0, 9.0], "k_R": [0.6, 0.6, 0.2], "k_i": 1.0, "nets": {"on": True}, "k_v": [3.0, 3.0], "k_W": 30.0}
    laws = law, {"k_x": None, "k_i": 1.0, "k_v": 3.0, "k_W": 30.0000001}
    for name, law in zip("ab", laws, strict=True):
        spoilt(tmp_path / name, name=name, mission={"controller": {"type": "geometric", **law}}, outcome="completed")
    text = plain(answer(tmp_path, "/compare?a=a&b=b").text)
    told = "controller.k_x 9 default controller.k_R 0.6, 0.6, 0.2 default controller.nets.on on default"
    told += " controller.k_W 30.0 30.0000001"
    assert f"controller geometric geometric {told}" in text and "k_i" not in text and "k_v" not in text
    spoilt(tmp_path / "c", name="c", mission={"controller": {"type": "pid", "k_x": 1.0}}, outcome="completed")
    assert "k_x" not in plain(answer(tmp_path, "/compare?a=a&b=c").text), "of another law it is another gain"


def test_the_numbers_of_a_row_have_one_unit_and_a_lost_flight_s_last_state_is_no_row(tmp_path):
    spoilt(tmp_path / "a", name="a", **{"attitude": {"psi": {"rmse[rad]": 0.0004}}})
    spoilt(tmp_path / "b", name="b", **{"attitude": {"psi": {"rmse[rad]": 0.03}}, "ending": {"x[m]": 17.3}})
    text = answer(tmp_path, "/compare?a=a&b=b").text
    assert "0.0229°" in text and "1.72°" in text and "mrad" not in text
    assert row("position.x.rmse[m]", 7.476e-8, 0.039, 0.039)[:2] == ["7.48 × 10⁻⁵\u00a0mm", "39.0\u00a0mm"]
    assert row("position.x.rmse[m]", 1e-5, 2e-5, 0.039)[:2] == ["0.0100\u00a0mm", "0.0200\u00a0mm"], "as its y, of 39 mm"
    assert words("full_thrust_share") == "share of the time at a rotor's full thrust"
    assert row("attitude.psi.rmse[rad]", 2.2e-8, 0.0, 2.2e-8)[:2] == ["1.26 × 10⁻⁶\xa0°", "0°"]
    assert row("position.x.rmse[m]", 0.0039, 0.039, 0.039)[:2] == ["3.90\u00a0mm", "39.0\u00a0mm"]
    assert "ending" not in text


@pytest.mark.parametrize(("first", "second", "said"), [
    ({}, {"mission": {"path": {"type": "step"}}},
        "“a” and “b” fly different paths, so their errors do not say which is better."),
    ({"mission": {"vehicle": 1}}, {}, "“a” and “b” fly different vehicles, so their errors do not say which is better."),
    ({"ended[s]": 6.0}, {}, "“a” and “b” fly different durations, so their errors do not say which is better."),
    ({"outcome": "crashed"}, {}, "“a” was lost, so the errors are not compared."),
    ({"mission": {"score_from": 4.0}}, {},
        "Their errors do not say which is better: those of “a” count from 4\u00a0s on and those of “b” over the whole "),
    ({"mission": {"score_from": 4.0, "path": {"type": "step"}}}, {},
        "“a” and “b” fly different paths, so their errors do not say which is better; those of “a” count from 4\u00a0s on"),
])  # fmt: skip
def test_flights_that_differ_in_more_than_their_error_are_not_ranked(tmp_path, first, second, said):
    for name, content in (("a", first), ("b", second)):
        rmse = 0.01 if name == "a" else 0.03
        numbers = {"position_rmse[m]": rmse, "outcome": "completed", "ended[s]": 5.0, "mission": {}}
        spoilt(tmp_path / name, name=name, **{**numbers, **content})
    text = answer(tmp_path, "/compare?a=a&b=b").text
    assert said in text
    assert "times closer" not in text and "second / first" not in text
    late = "count from" in said
    assert ("<dt>a: position RMSE from 4\u00a0s on</dt>" in text) == late and "<dt>b: position RMSE</dt>" in text
    assert ("errors count from 4\u00a0s on over the whole flight" in plain(text).replace("4 s", "4\u00a0s")) == late
    alike = "paths" not in said and "vehicles" not in said
    assert ("#keep=b" in text) == alike == ('src="/thumbs?a=a&amp;b=b"' in text)
    assert text.count("<dt>") == 2
    assert text.count("<dd class=fails>lost<") == ("lost" in said), "a lost flight has no error to show"
    shown = [one["id"] for one in data_of(answer(tmp_path, "/both?a=a&b=b").text)["flights"]]
    assert shown == ["a", "b"]


def test_of_two_flights_of_one_path_the_errors_are_drawn_over_time_and_their_loops_are_rows(tmp_path):
    for name, error, word in (("near_d", 0.039, "sound"), ("far", 0.074, "fragile")):
        rest = {"grade": word, "why": f"{word}, as it is"}
        mission = {"controller": {"type": {"near_d": "geometric", "far": "lqr"}[name]}}
        numbers = {"outcome": "completed", "ended[s]": 1.0, "mission": mission, "margins_at_rest": rest}
        spoilt(tmp_path / name, name=name, **numbers)
        rows = "".join(f"{0.1 * i},{error * i / 10},0,1,0,0,1\n" for i in range(11))
        (tmp_path / name / "flight.csv").write_text("t[s],x[m],y[m],z[m],x_d[m],y_d[m],z_d[m]\n" + rows)
    text = answer(tmp_path, "/compare?a=near_d&b=far").text
    (told,) = (json.loads(unescape(one)) for one in re.findall(r'data-axes="([^"]*)"', text))
    assert [one["name"] for one in told[0]["curves"]] == ["“near_d”", "“far”"]
    assert told[0]["up"] == "distance [mm]" and 74.0 < told[0]["y"]["high"] < 90.0
    rows = re.findall(r"<tr><td>(controller|loop at rest|its margins)</td><td[^>]*>(.*?)</td><td[^>]*>(.*?)</td>", text)
    assert rows[0] == ("controller", "geometric", "lqr"), "whatever the flights are called"
    assert rows[1:] == [("loop at rest", "sound", "fragile"), ("its margins", "sound, as it is", "fragile, as it is")]
    assert "“near_d” is the closer one 100\N{NO-BREAK SPACE}% of the time." in text
    for picture in ("/thumbs?a=near_d&b=far", "/thumb/far/"):
        assert 'font-family: "Inter"' in answer(tmp_path, picture).text, "as the page around it"
    for name in ("near_d", "far"):
        content = json.loads((tmp_path / name / "metrics.json").read_text())
        (tmp_path / name / "metrics.json").write_text(json.dumps({**content, "name": f"{name}: {'a long name ' * 8}"}))
    (told,) = (
        json.loads(unescape(one))
        for one in re.findall(r'data-axes="([^"]*)"', answer(tmp_path, "/compare?a=near_d&b=far").text)
    )
    assert [one["name"] for one in told[0]["curves"]] == [
        "“near_d: a long name a long name a…”",
        "“far: a long name a long name a lo…”",
    ]
    cards = answer(tmp_path, "/").text
    assert '<b class="fair"><span aria-hidden="true">!</span> loop fragile</b>' in cards
    assert "flew 1\u00a0s under geometric; " in cards and "flew 1\u00a0s under lqr; " in cards


@pytest.mark.parametrize("loops", [("sound", "fragile"), ("fragile", "sound"), ("unstable", "fragile")])
def test_the_closer_one_s_bad_loop_is_said_and_marked(tmp_path, loops):
    for name, rmse, loop in zip("ab", (0.01, 0.07), loops, strict=True):
        numbers = {"outcome": "completed", "ended[s]": 1.0, "grade": "flew, but", "position_rmse[m]": rmse}
        spoilt(tmp_path / name, name=name, **numbers, mission={"controller": {"type": "lqr"}}, **{AT_REST: {"grade": loop}})
    text = answer(tmp_path, "/compare?a=a&b=b").text
    (said,) = re.findall(r'class="answer">(.*?)</p>', text)
    assert said.endswith({"sound": "over the whole flight."}.get(loops[0], f"flight, but its loop is {loops[0]} at rest."))
    marks = {
        "sound": "controller: lqr",
        "fragile": "controller: lqr, ! loop fragile",
        "unstable": "controller: lqr, ! loop unstable at rest",
    }
    assert re.findall(r"<small>(.*?)</small>", text) == [marks[one] for one in loops]
    assert re.search("<td>grade</td>(<td[^>]*>flew, but not as commanded</td>){2}", text)


def test_of_a_lost_flight_on_another_path_the_path_comes_first(tmp_path):
    spoilt(tmp_path / "a", name="a", **{"outcome": "crashed", "ended[s]": 1.0, AT_REST: {"grade": "unstable"},
           "mission": {"path": {"type": "step"}, "controller": {"type": "lqr"}}})  # fmt: skip
    spoilt(tmp_path / "b", name="b", **{"outcome": "completed", "ended[s]": 5.0, "mission": {}})
    text = answer(tmp_path, "/compare?a=a&b=b").text
    assert "“a” and “b” fly different paths, so " in text
    assert "<dt>a: flight</dt><dd class=fails>lost<small>controller: lqr, ! loop unstable at rest</small>" in text
    assert re.search("<td>loop at rest</td><td[^>]*>unstable</td><td[^>]*>–</td>", text), "though only one is known"


def test_two_maps_are_said_to_differ_in_what_flew_before_the_wind(tmp_path):
    for name, vehicle, wind in (("a", "x500", 0.0), ("b", "crazyflie", 3.0)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "report.html").write_text(page_text(name, [summary(f"In all cells {name}.")], "envelope"))
        mission = {"vehicle": {"preset": vehicle}, "wind": {"mean": [wind, 0.0, 0.0]}}
        (tmp_path / name / "metrics.json").write_text(json.dumps({"mission": mission, "axes": {"x": {"key": name}}}))
    text = plain(answer(tmp_path, "/compare?a=a&b=b").text)
    assert re.search(r"“a” and “b” are not ranked, because their vehicles, axes and winds \(.*\) differ\.", text)


def test_a_report_beside_the_file_that_it_is_of_is_called_a_report(tmp_path):
    (tmp_path / "mine.html").write_text(page_text("mine", [summary("Roll can be tuned.")], "Identification"))
    assert '<div class="files"><a href="/files/mine.html">Report</a></div>' in answer(tmp_path, "/").text


@pytest.mark.parametrize(
    ("flights", "bad", "said"),
    [(72, 72, "none of 72 as commanded"), (1240, 3, "3 of 1,240 not as commanded"), (1, 1, "not as commanded"),
     (72, 0, ""), (0, 0, ""), ("72", 72, "")],
)  # fmt: skip
def test_a_study_whose_flights_are_not_as_commanded_has_a_mark(tmp_path, flights, bad, said):
    graded = {"graded": {"flights": flights, "not as commanded": bad}}
    for name, file, content in (("map", "metrics", graded), ("campaign", "campaign", {"summary": graded})):
        (tmp_path / name).mkdir()
        (tmp_path / name / "report.html").write_text(page_text(name, [summary("An answer.")], name))
        (tmp_path / name / f"{file}.json").write_text(json.dumps(content))
    mark = f'<b class="fair"><span aria-hidden="true">!</span> {said}</b>'
    text = answer(tmp_path, "/").text.replace("\u00a0", " ")
    assert text.count(mark) == 2 * bool(said) and text.count("as commanded</b>") == 2 * bool(said)


def test_a_proof_of_instability_has_a_mark(tmp_path):
    """By its verdict, not by its words."""
    for name, kind, unstable in (("a", VerdictKind.DISPROVED, True), ("b", VerdictKind.DISPROVED, False)):
        verdict = ProofVerdict(name, kind, [], ["it is not so that hover is proved unstable"], unstable=unstable)
        write_report(tmp_path / name / "certificate.html", verdict)
    assert [one.loop for one in results(tmp_path)] == ["unstable", ""]


def test_a_campaign_of_a_fragile_loop_has_its_mark(tmp_path):
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "report.html").write_text("<title>One</title>")
    (tmp_path / "one" / "campaign.json").write_text(json.dumps({"summary": {AT_REST: {"grade": "fragile"}}}))
    assert '<b class="fair"><span aria-hidden="true">!</span> loop fragile</b>' in answer(tmp_path, "/").text


@pytest.mark.parametrize(
    ("since", "said"),
    [(0.0, "“b” is the closer one 70 % of the time."), (0.5, "“a” is the closer one 60 % of the time from 0.5 s on.")],
)
def test_of_two_flights_it_is_said_which_is_the_closer_one_for_longer(tmp_path, since, said):
    for name, errors in (("a", [2] * 8 + [0] * 3), ("b", [1] * 11)):
        mission = {"score_from": since}
        spoilt(tmp_path / name, name=name, mission=mission, **{"outcome": "completed", "ended[s]": 1.0})
        rows = "".join(f"{0.1 * i},{error},0,1,0,0,1\n" for i, error in enumerate(errors))
        (tmp_path / name / "flight.csv").write_text("t[s],x[m],y[m],z[m],x_d[m],y_d[m],z_d[m]\n" + rows)
    assert said in answer(tmp_path, "/compare?a=a&b=b").text.replace("\N{NO-BREAK SPACE}", " ")


def test_beside_a_lost_flight_no_error_is_shown_and_else_the_rows_that_say_most_come_first(tmp_path):
    for name, rmse, outcome in (("near", 3.41e-6, "completed"), ("far", 0.0172, "completed"), ("gone", 9.0, "crashed")):
        errors = {"position": {"x": {"rmse[m]": rmse, "final[m]": rmse}}, "position_rmse[m]": rmse, "largest_error[m]": rmse}
        spoilt(tmp_path / name, name=name, outcome=outcome, **{"ended[s]": 5.0, "largest_tilt[rad]": 0.1}, **errors)
    text = answer(tmp_path, "/compare?a=near&b=gone").text
    assert re.findall("<tr><td>([^<]+)</td>", text) == ["grade", "time flown", "largest tilt"]
    told, more = answer(tmp_path, "/compare?a=near&b=far").text.split("<details")
    assert re.findall("<tr><td>([^<]+)</td>", told) == ["time flown", "largest tilt", "position RMSE", "largest error"]
    assert re.findall("<tr><td>([^<]+)</td>", more) == ["x error, RMSE", "x error, at the end"]
    assert row("saturated_share", 0.0, 0.569, 0.569)[:2] == ["0 %", "56.9 %"]
    assert "0.00341\u00a0mm" in told and "µm" not in told, "two numbers that are compared have one unit"


def test_two_flights_of_one_name_are_told_apart_by_their_places(tmp_path):
    (tmp_path / "Ada").mkdir()
    for place in ("Ada/1", "2"):
        spoilt(tmp_path / place, name="Round", **{"outcome": "completed", "ended[s]": 5.0})
    flights = data_of(answer(tmp_path, "/both?a=Ada/1&b=2").text)["flights"]
    assert [one["name"] for one in flights] == ["Round (Ada/1)", "Round (2)"]
    assert f"#keep={flights[1]['id']}" in answer(tmp_path, "/compare?a=Ada/1&b=2").text


def test_of_two_in_other_wind_it_is_said(tmp_path):
    for name, mission in (("a", {"wind": {"mean": [5.0, 0.0, 0.0]}, "events": [1]}), ("b", {})):
        rmse = 0.01 if name == "a" else 0.03
        spoilt(
            tmp_path / name, name=name, mission=mission,
            **{"position_rmse[m]": rmse, "outcome": "completed", "ended[s]": 5.0, "saturated_share": 0.0},
        )  # fmt: skip
    text = answer(tmp_path, "/compare?a=a&b=b").text
    assert "With different events and winds (5\u00a0m/s; none): “a” is 3.0 times closer to its path than “b”, " in text
    assert "share of the time at a rotor" not in text, "which is 0 in both"
    late = [{"mission": {"sensors": {"latency": one}}} for one in (0.02, 0.12)]
    assert conditions(*late) == conditions(late[0], {"mission": 1}) == "sensors"


def test_a_lost_flight_has_no_error_to_rank_it_by_and_a_late_score_is_said(tmp_path):
    """One that was lost at once has the smallest error of all."""
    spoilt(tmp_path / "a", name="a", **{"position_rmse[m]": 1e-6, "outcome": "crashed", "ended[s]": 0.1})
    late = {"position_rmse[m]": 1e-3, "outcome": "completed", "ended[s]": 5.0, "mission": {"score_from": 4.0}}
    spoilt(tmp_path / "b", name="b", **late)
    assert [one.rmse for one in results(tmp_path)] == [None, 1e-3]
    text = answer(tmp_path, "/").text
    assert text.count('data-rmse=""') == 1
    assert "flew 5\u00a0s; errors count from 4\u00a0s on" in text


@pytest.mark.parametrize(("content", "says"), [
    ({"grade": "as commanded", "outcome": "completed", "ended[s]": 5.0}, ["✓</span> as commanded", "flew 5\u00a0s"]),
    ({"grade": "flew, but", "grade_reasons": ["it tilted to 139°"], "outcome": "completed", "ended[s]": 5.0},
        ["!</span> flew, but not as commanded", "flew 5\u00a0s, but it tilted to 139°"]),
    ({"grade": "as commanded", "outcome": "crashed", "ended[s]": 5.0}, ["✕</span> lost",
        "lost at 5\u00a0s: it hit the ground"]),
])  # fmt: skip
def test_a_card_marks_the_grade_of_its_flight(tmp_path, content, says):
    spoilt(tmp_path / "one", name="one", **content)
    assert all(words in answer(tmp_path, "/").text for words in says)


def test_a_card_says_what_its_report_answers(tmp_path):
    text = '<style></style><p class="answer">95 % of <b>200</b> flights are &lt;fine&gt;.</p><p class="answer">Another.</p>'
    (tmp_path / "report.html").write_text(text)
    (found,) = results(tmp_path)
    assert found.says == "95 % of 200 flights are <fine>."
    assert '<p class="says">95\u00a0% of 200 flights are &lt;fine&gt;.</p>' in answer(tmp_path, "/").text
    (tmp_path / "report.html").write_text("<p>Nothing of the kind.</p>")
    assert results(tmp_path)[0].says == ""
    report = page_text("A", [summary("The error left the ball b_r <once>.")], "Certificate")
    (tmp_path / "report.html").write_text(report, encoding="utf-8")
    assert '<p class="says">The error left the ball b<sub>r</sub> &lt;once&gt;.</p>' in answer(tmp_path, "/").text


def test_a_study_s_card_begins_with_its_title_and_sets_its_numbers_as_symbols(tmp_path):
    (tmp_path / "report.html").write_text('<p class="answer">Fine.</p><div><dt>K<sub>min</sub></dt><dd>1.94</dd></div>')
    text = answer(tmp_path, "/").text
    assert '<p class="says">Fine.</p><p class="facts"><span><b>1.94</b> K<sub>min</sub></span></p>' in text
    assert 'class="thumb"' not in text


def test_only_results_of_one_kind_can_be_ticked_and_the_two_are_named(tmp_path, browsers):
    for name in ("a", "b"):
        spoilt(tmp_path / name, name=f"flight {name}")
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "report.html").write_text("<p>A report</p>")
    with serving(server(tmp_path, 0)) as port:
        page = browsers[False].page()
        page.goto(f"http://127.0.0.1:{port}/")
        boxes = {name: page.locator(f"input[value={name}]") for name in ("a", "b", "study")}
        boxes["a"].check()
        assert page.inner_text("#together") == "“flight a”: tick another to compare"
        assert boxes["study"].is_disabled() and boxes["b"].is_enabled()
        boxes["b"].check()
        assert page.inner_text("#together") == "Compare “flight a” and “flight b”"
        assert page.get_attribute("#together", "href") == "/compare?a=a&b=b"
        boxes["a"].uncheck()
        boxes["b"].uncheck()
        assert page.locator("#together").is_hidden() and boxes["study"].is_enabled()


def test_a_card_has_the_title_and_the_kind_of_its_report(tmp_path):
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "campaign.json").write_text("{}")
    text = page_text("Wind & <rain>", [summary("1 of 10⁶.")], "Rare failures")
    (tmp_path / "c" / "report.html").write_text(text, encoding="utf-8")
    (found,) = results(tmp_path)
    assert (found.name, found.kind, found.says) == ("Wind & <rain>", "Rare failures", "1 of 10⁶.")
    (tmp_path / "c" / "report.html").write_text("<p>Somebody else's.</p>")
    assert results(tmp_path)[0][1] == "c"
    assert results(tmp_path)[0].kind == "Campaign"


def test_an_article_has_its_own_title_and_no_place_or_picture_that_says_nothing(tmp_path):
    (tmp_path / "article.html").write_text("<title>Explained</title>")
    (found,) = results(tmp_path)
    assert (found.name, found.kind) == ("Explained", "Article")
    text = answer(tmp_path, "/").text
    assert '<p class="place"></p>' in text and 'class="thumb"' not in text


def test_pages_of_another_kind_in_one_folder_have_a_card_each_without_a_picture_or_a_comparison(tmp_path):
    def page(kind: str, answer: str) -> str:
        return f'<title>{kind} of mine</title><span>quadstep · {kind}</span><p class="answer">{answer}</p>'

    (tmp_path / "case-proof.json").write_text("{}")
    (tmp_path / "case-proof.html").write_text(page("Proof", "Proved."))
    (tmp_path / "mine.html").write_text(page("Identification", "Fitted."))
    (tmp_path / "chart.png").write_bytes(b"PNG")
    found = results(tmp_path)
    assert [(one.kind, one.says, one.files) for one in found] == [
        ("Proof", "Proved.", ("case-proof.html",)), ("Identification", "Fitted.", ("mine.html",)),
    ]  # fmt: skip
    text = answer(tmp_path, "/").text
    assert "<option>Proof</option>" in text and "checkbox" not in text and 'class="thumb"' not in text

    (tmp_path / "report.html").write_text(page("Campaign", "Fine."))
    (tmp_path / "more.html").write_text(page("Campaign", "More."))
    campaign, *others = results(tmp_path)
    assert (campaign.kind, campaign.files) == ("Campaign", ("report.html", "more.html"))
    assert [one.kind for one in others] == ["Proof", "Identification"]


def test_a_folder_without_results_says_what_makes_some(tmp_path):
    assert "<code>quadstep fly</code>" in answer(tmp_path, "/").text


def test_cards_have_kind_picture_and_error(tmp_path):
    spoilt(tmp_path / "one", name="one", **{"position_rmse[m]": 0.0123})
    (tmp_path / "one" / "figures").mkdir()
    (tmp_path / "one" / "figures" / "position.png").write_bytes(b"\x89PNG")
    (found,) = results(tmp_path)
    assert (found.kind, found.picture, found.rmse) == ("Flight", "figures/position.png", 0.0123)
    text = answer(tmp_path, "/").text
    assert 'src="/thumb/one/"' in text
    (tmp_path / "one" / "figures" / "position.png").rename(tmp_path / "one" / "figures" / "step.svg")
    assert results(tmp_path)[0].picture == "figures/step.svg"
    assert "RMSE 12.3\u00a0mm" in text and "checkbox" in text


def test_an_article_is_not_offered_for_a_comparison(tmp_path):
    (tmp_path / "article.html").write_text("<title>An article</title>")
    text = answer(tmp_path, "/").text
    assert "An article" in text and "checkbox" not in text


# For others: only with the token


@pytest.fixture
def shared(root):
    access = Access("127.0.0.1", "a-token")
    with serving(server(root, 0, access)) as where:
        yield where


def test_without_the_token_nothing_is_shown(shared):
    for path in ("/", "/files/report/report.html", "/?token=", "/?token=wrong", "/compare?a=report&b=report", "/?token=é"):
        status, _, text = get(shared, quote(path, safe="/?=&"))
        assert status == 403, path
        assert "flight" not in text
    for cookie in (f"quadstep-{shared}=wrong", "quadstep=a-token", "a-token", f"quadstep-{shared}="):
        assert get(shared, "/", headers={"Cookie": cookie})[0] == 403, cookie


def test_the_link_opens_the_list_under_any_name_of_the_machine(shared):
    status, headers, _ = get(shared, "/?token=a-token", host="lab.example")
    assert (status, headers["Location"]) == (303, "/")
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Lax" in cookie
    status, _, text = get(shared, "/", host="lab.example", headers={"Cookie": cookie.partition(";")[0]})
    assert status == 200
    assert "Anyone who has the link" in text
    assert get(shared, "/files/report/report.html", headers={"Cookie": f"x=1; {cookie.partition(';')[0]}"})[0] == 200


def test_a_token_is_long_random_and_only_for_others():
    assert not access("127.0.0.1").shared
    assert access("localhost") == access("127.0.0.1")
    tokens = {access("0.0.0.0").token for _ in range(20)}
    assert len(tokens) == 20
    assert min(map(len, tokens)) >= 20
    assert access("::1").link(1).startswith("http://[::1]:1/?token=")
    with pytest.raises(UserError, match="--host: 'no such host' is not an address"):
        access("no such host")


def test_an_address_of_another_machine_is_one_line(root):
    with pytest.raises(UserError, match=r"port 0 of 192\.0\.2\.1 cannot be used"):
        server(root, 0, Access("192.0.2.1", "t"))


def test_a_qr_code_is_drawn_where_its_extra_is_there_and_else_named(monkeypatch):
    lines = qr_text("http://192.0.2.1:8765/?token=abc").splitlines()
    assert len({len(line) for line in lines}) == 1
    assert max(map(len, lines)) < 60
    assert qr_drawing("http://x/").startswith("<svg")
    monkeypatch.setitem(sys.modules, "segno", None)
    assert qr_drawing("http://x/") == ""
    with pytest.raises(UserError, match="the QR code needs segno; install it"):
        qr_text("http://x/")


def test_a_study_is_listed_with_a_panel_of_its_figure_whose_axes_are_told(tmp_path):
    (tmp_path / "report.html").write_text("<p>A report</p>")
    panels = [Panel("speed", "m/s", {"v": np.linspace(1.0, 300.0, 50)}), Panel("e_{x}", "m", {"e": np.ones(50)})]
    FigureJob("convergence", "", np.linspace(0.0, 10.0, 50), panels, 1).draw(tmp_path, Sheet(("svg",)))
    listed = answer(tmp_path, "/").text
    assert 'src="/panel/convergence.svg"' in listed
    found = answer(tmp_path, "/panel/convergence.svg")
    assert (found.status, found.kind) == (200, "image/svg+xml")
    assert "sandbox" in found.headers["Content-Security-Policy"], "a figure may be another's, with a script"
    root = ElementTree.fromstring(found.text)
    *said, plot = [one.text for one in root.findall(f"{SVG}text")], root.find(f"{SVG}svg")
    assert said[0] == ["speed [m/s], 1 to 300", "time [s], 0 to 10"]
    told = json.loads(unescape(re.search('data-axes="([^"]*)"', (tmp_path / "convergence.svg").read_text())[1]))[0]
    assert [float(one) for one in plot.get("viewBox").split()] == pytest.approx(told["box"], abs=0.01)
    text = (tmp_path / "convergence.svg").read_text()
    (tmp_path / "convergence.svg").write_text(re.sub(r", &quot;data&quot;: ?\[[^]]*\]|,&quot;data&quot;:\[[^]]*\]", "", text))
    assert [short(one) for one in (1.94e-6, 0.0012, -1234.0)] == ["1.9 × 10⁻⁶", "0.0012", "−1,200"]
    older = ElementTree.fromstring(answer(tmp_path, "/panel/convergence.svg").text)
    assert [one.text for one in older.findall(f"{SVG}text")] == ["speed [m/s]", "time [s]"]


@pytest.mark.parametrize(
    "figure",
    ["", "<svg></svg>", *(f'<svg data-axes="{one}"></svg>' for one in ("[]", "5", "[5]", "[" * 9999, "[{}]", "x"))],
    ids=range(8),
)
def test_a_figure_that_is_not_ours_is_shown_as_it_is(tmp_path, figure):
    (tmp_path / "chart.svg").write_text(figure)
    assert answer(tmp_path, "/panel/chart.svg").text == figure
    assert answer(tmp_path, "/panel/none.svg").status == 404


def test_a_list_finds_words_of_its_cards_and_is_as_it_was_when_the_browser_goes_back(browsers, tmp_path):
    for name, loop in {"circle": "fragile", "figure eight": "sound", "step": "fragile"}.items():
        (tmp_path / name).mkdir()
        content = {"name": name, "outcome": "completed", "ended[s]": 9.0, "grade": "as commanded", AT_REST: {"grade": loop}}
        (tmp_path / name / "metrics.json").write_text(json.dumps(content))
    with serving(server(tmp_path, 0)) as port:
        page = browsers[False].page()
        page.goto(f"http://127.0.0.1:{port}/")
        page.fill("#search", "fragile")
        page.select_option("#order", "name")
        shown = "[...document.querySelectorAll('#cards > li:not([hidden])')].map((card) => card.dataset.name)"
        assert page.evaluate(shown) == ["circle", "step"]
        page.goto(f"http://127.0.0.1:{port}/files/step/metrics.json")
        page.go_back()
        page.wait_for_function("() => document.querySelector('#search').value === 'fragile'")
        assert page.evaluate(shown) == ["circle", "step"]
        page.fill("#search", "helix")
        assert page.locator("#count").inner_text() == "0 of 3 results"
        page.click("#all")
        assert len(page.evaluate(shown)) == 3
        browsers[False].blank()


def test_pages_that_lie_loose_in_a_folder_are_results_of_their_own(tmp_path):
    for name in ("page", "gusts", "explain"):
        (tmp_path / f"{name}.html").write_text(f"<title>The {name}</title>")
    assert sorted(one.name for one in results(tmp_path)) == ["The explain", "The gusts", "The page"]
    (tmp_path / "article.html").write_text("<title>The article</title>")
    assert sorted((one.name, one.kind, len(one.files)) for one in results(tmp_path)) == [
        ("The article", "Article", 1), ("The explain", "Page", 1), ("The gusts", "Page", 1), ("The page", "Page", 1),
    ]  # fmt: skip


LOG = "t[s],x[m],y[m],z[m],x_d[m],y_d[m],z_d[m]\n"


def stamped(root, rows, outcome="completed"):
    """The answer for the thumbnail of a flight with these rows of its log."""
    (root / "one").mkdir(exist_ok=True)
    (root / "one" / "flight.csv").write_text(rows)
    (root / "one" / "metrics.json").write_text(json.dumps({"ended[s]": 1.0, "outcome": outcome}))
    return answer(root, "/thumb/one/")


def test_a_flight_is_listed_with_a_picture_of_its_path_and_of_where_it_was_lost(tmp_path):
    rows = "".join(f"{t},{10 * t},{5 * t * t},{0.1 * t},{10 * t},{5 * t * t},0\n" for t in np.linspace(0.0, 1.0, 1000))
    found = stamped(tmp_path, LOG + rows)
    assert (found.status, found.kind) == (200, "image/svg+xml")
    desired, flown = re.findall(r'<path d="M([^"]*)"', found.text)[:2]
    points = np.array([[float(one) for one in pair.split()] for pair in flown.split("L")])
    assert len(points) > 200
    assert np.allclose(points[:, 1] - points[0, 1], -((points[:, 0] - points[0, 0]) ** 2) / 440.0, atol=0.2)
    assert desired == flown, "they differ in height, which is not seen from above"
    assert "from above: 10 m in x, 5 m in y" in found.text
    far = LOG + "".join(f"{t},{100 * t},0,{3 * t},0,0,0\n" for t in (0.0, 1.0))
    assert "from above: 100 m in x, 0 m in y" in stamped(tmp_path, far).text
    stamped(tmp_path, LOG + rows)
    assert "--blue:" in found.text
    assert "var(--bad)" not in found.text.split("<path")[3]
    assert "var(--bad)" in stamped(tmp_path, LOG + rows, "diverged").text.split("<path")[3]
    two = answer(tmp_path, "/thumbs?a=one&b=one")
    assert (two.kind, two.text.count("<path")) == ("image/svg+xml", 5) and "stroke-dasharray" in two.text
    assert answer(tmp_path, "/thumbs?a=one&b=none").status == 404
    listed = answer(tmp_path, "/").text
    assert 'src="/thumb/one/"' in listed


@pytest.mark.parametrize(
    "log",
    ["", LOG, "t,x\n1,2\n", LOG + "1,2\n" * 9, *(LOG + f"1,{x},2,3,4,5,6" for x in ("a", "nan", "1e300")), "," * 99999],
    ids=range(8),
)
def test_a_log_that_cannot_be_drawn_has_no_picture(tmp_path, log):
    assert stamped(tmp_path, log).status == 404
    assert stamped(tmp_path, LOG + "1,2,3,4,5,6,7").status == 200, "one row is a point"
