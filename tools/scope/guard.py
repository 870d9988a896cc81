# SPDX-License-Identifier: MIT
"""Lets in this machine's own browser, and no page of another site that it has open.

Any site can make a browser send requests to 127.0.0.1, and a name of its own can point there. So
the Host must be this server's, and an Origin, where there is one, too: for http and websocket.
"""

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse

NAMES = ("127.0.0.1", "localhost")


class Guard:
    """ASGI middleware: 400 for a foreign Host, 403 for a foreign Origin; a websocket is closed."""

    def __init__(self, app, port):
        self._app = app
        self._hosts = {f"{name}:{port}" for name in NAMES}
        self._origins = {f"http://{host}" for host in self._hosts}

    async def __call__(self, scope, receive, send):
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        origin = headers.get("origin")
        if headers.get("host") not in self._hosts:
            await self._refuse(scope, receive, send, 400, "this server has another name")
        elif origin is not None and origin not in self._origins:
            await self._refuse(scope, receive, send, 403, "another site may not use this one")
        else:
            await self._app(scope, receive, send)

    async def _refuse(self, scope, receive, send, code, words):
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008, "reason": words})
            return
        await PlainTextResponse(words + "\n", code)(scope, receive, send)
