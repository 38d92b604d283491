"""What is no Dask scheduler is told in one sentence, within ten seconds, and nothing is said at the end."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time

import pytest

from rendulic.foundation.errors import InvalidInput
from rendulic.study.execution.cluster import ClusterWorkers

pytest.importorskip("distributed")

# what a server says to whoever connects; None: it listens, and that is all
SERVERS = {
    "silent": (None, "it does not answer"),
    "of the web": (b"HTTP/1.1 400 Bad Request\r\n\r\n" * 100, "what answers there is no scheduler"),
    "of endless messages": (b"\xff" * 4000, "what answers there is no scheduler"),
    "closing": (b"", "."),
}


@pytest.fixture
def server():
    """Start a server that says something, and return its address."""
    stop, listening = threading.Event(), []

    def serve(listener, said):
        kept = []
        while not stop.is_set():
            try:
                connection = listener.accept()[0]
            except OSError:
                continue
            if said is not None:
                connection.sendall(said)
            if said == b"":
                connection.close()
            kept.append(connection)
        for connection in kept:
            connection.close()

    def start(said):
        listener = socket.create_server(("127.0.0.1", 0))
        listener.settimeout(0.1)
        thread = threading.Thread(target=serve, args=(listener, said))
        thread.start()
        listening.append((listener, thread))
        return f"tcp://127.0.0.1:{listener.getsockname()[1]}"

    yield start
    stop.set()
    for listener, thread in listening:
        thread.join()
        listener.close()


@pytest.mark.parametrize("kind", SERVERS)
def test_a_server_that_is_no_scheduler_is_told_soon(server, tmp_path, kind):
    said, words = SERVERS[kind]
    address = server(said)
    begin = time.monotonic()
    with pytest.raises(InvalidInput, match=f"no Dask scheduler at {address}: {words}"):
        ClusterWorkers(tmp_path, address)
    assert time.monotonic() - begin < 10.0


@pytest.mark.parametrize(
    "address", ["nonsense", "", "http://host:80", "tcp://[", "tcp://host:99999999", "host", "/tmp"]
)
def test_what_is_no_address_is_told_at_once(tmp_path, address):
    begin = time.monotonic()
    with pytest.raises(InvalidInput, match=r"is like tcp://host:8786, or a scheduler file; got '"):
        ClusterWorkers(tmp_path, address)
    assert time.monotonic() - begin < 5.0


@pytest.mark.parametrize(
    "text", ["", "[[specimen]]", "[1]", '{"address": 3}', '{"address": "nonsense"}', "[" * 10_000, "\udc80"]
)
def test_a_file_that_is_of_no_scheduler_is_told(tmp_path, text):
    path = tmp_path / "scheduler.json"
    path.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(InvalidInput, match=r"scheduler.json"):
        ClusterWorkers(tmp_path, str(path))


def test_nothing_is_said_when_the_program_ends(server, tmp_path):
    """The client of Dask would go on trying, and end in a traceback minutes later."""
    code = (
        "import sys; from rendulic.study.execution.cluster import ClusterWorkers\n"
        "from rendulic.foundation.errors import InvalidInput\n"
        "try:\n    ClusterWorkers(sys.argv[1], sys.argv[2])\n"
        "except InvalidInput as error:\n    print(error)\n"
    )
    for kind in ("silent", "of the web"):
        ended = subprocess.run([sys.executable, "-c", code, str(tmp_path), server(SERVERS[kind][0])],
                               capture_output=True, text=True, timeout=60)  # fmt: skip
        assert ended.stdout.startswith("no Dask scheduler at tcp://127.0.0.1")
        assert ended.stderr == ""
        assert ended.returncode == 0
