"""The package websockets by its older interface: version 10, which is Debian 12's, has no other, and version 15, Debian 13's, has it still."""

from websockets import ConnectionClosed, InvalidHandshake, InvalidStatusCode, WebSocketException  # noqa: F401
from websockets.legacy.client import connect  # noqa: F401
from websockets.legacy.server import serve  # noqa: F401
