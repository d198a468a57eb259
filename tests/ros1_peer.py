"""One end of TCPROS for tests, on plain sockets."""

import socket
import struct
from xmlrpc.client import ServerProxy

from vrx_mj.ros.ros1.connection import decode_header, encode_header

ME = "/peer"


def frame(body: bytes) -> bytes:
    return struct.pack("<I", len(body)) + body


def taken(connection: socket.socket, count: int) -> bytes:
    """So many bytes, or fewer where the connection ends."""
    data = b""
    while len(data) < count and (part := connection.recv(count - len(data))):
        data += part
    return data


def frame_of(connection: socket.socket) -> bytes | None:
    """The next frame's body; None where the connection ends."""
    head = taken(connection, 4)
    return taken(connection, *struct.unpack("<I", head)) if len(head) == 4 else None


def stream_of(uri: str, topic: str) -> tuple[str, int]:
    """Where the node behind a master sends a topic."""
    with ServerProxy(uri) as master:
        api = master.lookupNode(ME, "/gazebo")[2]
    with ServerProxy(api) as node:
        code, _, (protocol, host, port) = node.requestTopic(ME, topic, [["TCPROS"]])
    assert (code, protocol) == (1, "TCPROS")
    return host, port


def service_of(uri: str, service: str) -> tuple[str, int]:
    with ServerProxy(uri) as master:
        host, _, port = master.lookupService(ME, service)[2].removeprefix("rosrpc://").partition(":")
    return host, int(port)


def dial(place: tuple[str, int], **fields: str) -> tuple[socket.socket, dict[str, str]]:
    """A connection with the header that came back."""
    connection = socket.create_connection(place, timeout=10.0)
    connection.sendall(encode_header({"callerid": ME, "md5sum": "*"} | fields))
    return connection, decode_header(frame_of(connection) or b"")
