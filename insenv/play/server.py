"""Pages of a session on this machine alone: events down as a stream, what is asked for up as small JSON.

Whoever asks must name this machine and port as the host (else a page of another site whose name was made to point
here could read along), and show the token that was told to the user alone. What does not is refused with 403.
"""

from __future__ import annotations

import json
import secrets
import socket
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from insenv.core.errors import InputError
from insenv.play.session import Session

#: The one address that is listened to.
ADDRESS = "127.0.0.1"
#: Pause between two deliveries of events [s]: 40 in a second.
_PAUSE = 0.025
#: Time without a watcher after which the last tab counts as closed [s]: to load a page anew takes less.
_GONE = 4.0
#: Largest request [bytes].
_MOST = 4096


class Server(ThreadingHTTPServer):
    """A session's server; ``url`` is where a browser finds it.

    Parameters
    ----------
    port : int
        0: any that is free.

    Raises
    ------
    InputError
        If the port cannot be had.
    """

    daemon_threads = True
    allow_reuse_address = False

    def __init__(self, port: int = 0) -> None:
        self.token = secrets.token_urlsafe(24)
        self.session: Session | None = None
        self.page = b""
        self.delivered = 0
        try:
            super().__init__((ADDRESS, port), _Handler)
        except (OSError, OverflowError) as error:
            said = getattr(error, "strerror", None) or str(error)
            raise InputError(
                f"--port {port}: cannot be had ({said}); wanted a port of {ADDRESS} that is free, or 0 for any"
            ) from None

    @property
    def port(self) -> int:
        """That is listened to."""
        return int(self.server_address[1])

    @property
    def url(self) -> str:
        """With the token."""
        return f"http://{ADDRESS}:{self.port}/?token={self.token}"

    def play(self, session: Session, page: str) -> None:
        """Serve a session until its last watcher has gone, or this is interrupted.

        Parameters
        ----------
        session : Session
        page : str
            HTML.
        """
        self.session, self.page = session, page.encode()
        session.start()
        threading.Thread(target=self._end_with_last, daemon=True).start()
        try:
            self.serve_forever(0.1)
        finally:
            session.close()
            self.server_close()

    def _end_with_last(self) -> None:
        assert self.session is not None
        came, left = False, time.monotonic()
        while True:
            time.sleep(0.2)
            if self.session.watchers:
                came, left = True, time.monotonic()
            elif came and time.monotonic() - left > _GONE:
                self.shutdown()
                return

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that hangs up is no error."""
        del request, client_address


class _Handler(BaseHTTPRequestHandler):
    server: Server
    server_version = "insenv"
    sys_version = ""
    timeout = 30

    def do_GET(self) -> None:  # noqa: N802 -- the name that http.server asks for
        """The page, the stream of events, or a report."""
        asked = urlsplit(self.path)
        given = parse_qs(asked.query)
        if not self._may(given.get("token", [""])[0]):
            return
        session = self.server.session
        assert session is not None
        if asked.path == "/":
            self._answer(self.server.page)
        elif asked.path == "/events":
            self._stream(session)
        elif asked.path == "/report" and (path := session.report(_number(given.get("run", [""])[0]))):
            self._report(path)
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:  # noqa: N802
        """Something is asked for: ``{"what": ..., "value": ...}``."""
        if not self._may(self.headers.get("X-Token", "")):
            return
        size = self.headers.get("Content-Length", "")
        if not size.isdigit() or int(size) > _MOST:
            self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
            return
        try:
            asked = json.loads(self.rfile.read(int(size)))
            what, value = str(asked["what"]), asked.get("value")
        except (ValueError, TypeError, KeyError, AttributeError):
            self.send_error(HTTPStatus.BAD_REQUEST)
            return
        assert self.server.session is not None
        self.server.session.ask(what, value)
        self.send_response(HTTPStatus.NO_CONTENT)
        self.end_headers()

    def _may(self, token: str) -> bool:
        """Whether host and token are right; else that was refused."""
        hosts = {f"{name}:{self.server.port}" for name in (ADDRESS, "localhost")}
        known = secrets.compare_digest(token.encode(), self.server.token.encode())
        if known and self.headers.get("Host", "") in hosts:
            return True
        self.send_error(HTTPStatus.FORBIDDEN)
        return False

    def _answer(self, body: bytes) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Frame-Options", "DENY")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        self.wfile.write(body)

    def _report(self, path: Path) -> None:
        try:
            self._answer(path.read_bytes())
        except OSError:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _stream(self, session: Session) -> None:
        """Server-sent events, several in one where they come fast; a comment where there is nothing new."""
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        for news in session.watch(_PAUSE):
            text = f"data: {json.dumps(news, allow_nan=False)}\n\n" if news else ": still there\n\n"
            try:
                self.wfile.write(text.encode())
            except OSError:
                return
            self.server.delivered += bool(news)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Nothing: the terminal is the user's."""


def _number(text: str) -> int:
    return int(text) if text.isdigit() and len(text) < 7 else -1
