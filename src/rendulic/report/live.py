"""A study shown while it runs, to the browsers of this machine only."""

from __future__ import annotations

import os
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Lock
from typing import Any

from rendulic.foundation.errors import InvalidInput, RendulicError
from rendulic.report.figure import Figure, embedded
from rendulic.report.page import CURVES, render, sections, template
from rendulic.study.execution.campaign import results_in
from rendulic.study.execution.status import status_of

__all__ = ["LiveView"]

LOOPBACK = "127.0.0.1"
MOST_FAILURES = 20  # that are named
Answer = tuple[str, str]  # type and text
POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
    "img-src data: blob:; worker-src blob:"
)


class LiveView:
    """Serves the page of one study on this machine's loopback address; a context.

    Parameters
    ----------
    folder : path
        Of a study.
    port : int
        0 for any that is free.

    Raises
    ------
    InvalidInput
        If the folder holds no study, or the port is taken.
    """

    def __init__(self, folder: str | os.PathLike, port: int = 0) -> None:
        self.folder = folder
        self.busy = Lock()  # results are read once at a time
        status_of(folder)
        try:
            self.server = ThreadingHTTPServer((LOOPBACK, port), _handler(self))
        except OSError as error:
            raise InvalidInput(f"port {port} cannot be had ({error.strerror}): choose another, or 0 for any") from None
        self.server.daemon_threads = True
        self.answers: dict[str, Callable[[], Answer]] = {
            "/": lambda: ("text/html", template("live.html").render(title=status_of(self.folder).title)),
            "/status.json": lambda: ("application/json", embedded(self.status())),
            "/figures.json": lambda: ("application/json", embedded(self.figures())),
            "/report.html": lambda: ("text/html", render(results_in(self.folder))),
            "/plotly.js": lambda: ("text/javascript", _plotly()),
        }

    def __enter__(self) -> LiveView:
        return self

    def __exit__(self, *_: object) -> None:
        self.server.server_close()

    @property
    def port(self) -> int:
        """Where it listens."""
        return self.server.server_address[1]

    @property
    def address(self) -> str:
        """For the browser."""
        return f"http://{LOOPBACK}:{self.port}/"

    def serve(self) -> None:
        """Answer until `stop` is called or the process is interrupted."""
        self.server.serve_forever(poll_interval=0.2)

    def stop(self) -> None:
        """End `serve`, from another thread."""
        self.server.shutdown()

    def status(self) -> dict[str, Any]:
        """How far the study is."""
        now = status_of(self.folder)
        failed = [[unit.label, error] for unit, error in now.failed.items()]
        return {
            "done": now.done, "total": now.total, "failed": failed[:MOST_FAILURES], "n_failed": len(failed),
            "kinds": [[kind, *counts] for kind, counts in now.kinds.items()],
            "running": [[unit.label, share] for unit, share in now.running.items()],
        }  # fmt: skip

    def figures(self) -> list[dict[str, Any]]:
        """Curves so far, in the order of the report."""
        parts = [part for section in sections(results_in(self.folder), CURVES) for part in section.parts]
        return [
            part.data() | {"name": part.name, "caption": part.caption} for part in parts if isinstance(part, Figure)
        ]


def _plotly() -> str:
    from plotly.offline import get_plotlyjs

    return get_plotlyjs()


def _handler(live: LiveView) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        """Reads nothing but the path that is asked for."""

        timeout = 30

        def do_GET(self) -> None:
            """Answer one of the paths."""
            names = {f"{host}:{live.port}" for host in (LOOPBACK, "localhost")}
            make = live.answers.get(self.path.partition("?")[0])
            # a page of another site that has its name point here must not read results
            if self.headers.get("Host") not in names:
                self._say(HTTPStatus.FORBIDDEN, "text/plain", "only for this machine")
            elif make is None:
                self._say(HTTPStatus.NOT_FOUND, "text/plain", "there is no such page")
            else:
                try:
                    with live.busy:
                        kind, text = make()
                except RendulicError as error:
                    self._say(HTTPStatus.INTERNAL_SERVER_ERROR, "text/plain", str(error))
                else:
                    self._say(HTTPStatus.OK, kind, text)

        def _say(self, status: HTTPStatus, kind: str, text: str) -> None:
            data = text.encode()
            self.send_response(status)
            self.send_header("Content-Type", f"{kind}; charset=utf-8")
            self.send_header("Content-Length", str(len(data)))
            self.send_header("Cache-Control", "no-store")
            self.send_header("Content-Security-Policy", POLICY)
            self.send_header("X-Content-Type-Options", "nosniff")
            self.end_headers()
            try:
                self.wfile.write(data)
            except OSError:  # the reader went away
                self.close_connection = True

        def log_message(self, *_: object) -> None:
            """The terminal belongs to the reader."""

    return Handler
