"""The live page's server: what it tells, to whom, and how it ends."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from threading import Thread

import pytest

from rendulic.foundation.errors import InvalidInput
from rendulic.report.live import LiveView
from rendulic.report.page import sections
from rendulic.study.execution.campaign import results_in

COMMAND = "from rendulic.cli.main import run; run()"


@pytest.fixture(scope="module")
def live(reported_study):
    """A server in a thread of its own, ended at the end."""
    with LiveView(reported_study) as view:
        server = Thread(target=view.serve)
        server.start()
        yield view
        view.stop()
        server.join(10)
        assert not server.is_alive()


def answer(live, path, **headers):
    """Status, headers and text."""
    connection = http.client.HTTPConnection("127.0.0.1", live.port, timeout=60)
    connection.request("GET", path, headers=headers)
    got = connection.getresponse()
    text = got.read().decode()
    connection.close()
    return got.status, dict(got.getheaders()), text


def test_it_tells_how_far_the_study_is(live, reported_study):
    """Counts of each kind, in the order of the work."""
    status, headers, text = answer(live, "/status.json?again")
    told = json.loads(text)
    wanted = results_in(reported_study).wanted
    assert (status, headers["Content-Type"]) == (200, "application/json; charset=utf-8")
    assert (told["done"], told["total"], told["running"], told["failed"]) == (len(wanted), len(wanted), [], [])
    assert {kind: total for kind, _, total in told["kinds"]}["state"] == 3


def test_it_draws_what_the_report_draws(live, reported_study):
    """The same data, figure by figure."""
    told = {figure["name"]: figure for figure in json.loads(answer(live, "/figures.json")[2])}
    assert {"fig1", "fig3", "cones", "fig9"} <= set(told)
    (section,) = sections(results_in(reported_study), ("loading",))
    assert told["fig1"]["families"] == json.loads(json.dumps(section.parts[0].data()["families"]))


def test_only_this_machine_is_answered(live):
    """Another name for the address is refused, another path unknown; nothing of the folder is served."""
    assert live.server.server_address[0] == "127.0.0.1"
    assert answer(live, "/status.json", Host="evil.example")[0] == 403
    assert answer(live, "/status.json", Host=f"localhost:{live.port}")[0] == 200
    for path in ("/study.json", "/../study.json", "/units", "/status.json/"):
        assert answer(live, path)[0] == 404
    with pytest.raises(urllib.error.HTTPError, match="501"):
        urllib.request.urlopen(live.address + "status.json", data=b"x", timeout=20)


def test_the_page_asks_nobody_else(live):
    """Its policy says so."""
    status, headers, text = answer(live, "/")
    assert status == 200
    assert "A &lt;b&gt;little&lt;/b&gt; of everything" in text
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "connect-src 'self'" in headers["Content-Security-Policy"]


def test_what_cannot_be_shown_is_said_at_once(live, tmp_path):
    """No study in the folder; a port that is taken."""
    with pytest.raises(InvalidInput, match="is not the folder of a study"):
        LiveView(tmp_path)
    with pytest.raises(InvalidInput, match=f"port {live.port} cannot be had"):
        LiveView(live.folder, live.port)


@pytest.mark.skipif(os.name != "posix", reason="signals of this kind are those of Unix")
@pytest.mark.parametrize("ending", ["SIGINT", "SIGTERM"])
def test_it_ends_when_told(reported_study, ending):
    """With code 0, one line, and its port free again."""
    arguments = [sys.executable, "-c", COMMAND, "view", str(reported_study), "--port", "0", "--no-open"]
    process = subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"}
    )
    try:
        address = process.stdout.readline().split()[0]
        with urllib.request.urlopen(f"{address}status.json", timeout=60) as got:
            assert got.status == 200
        process.send_signal(getattr(signal, ending))
        rest, errors = process.communicate(timeout=30)
    finally:
        process.kill()
    assert (process.returncode, rest.strip(), errors) == (0, "ended", "")
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(address, timeout=5)
