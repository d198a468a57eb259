"""What an HTTP request must be to be a program's call by XML-RPC, and none that a web page has a browser send.

A page may POST to any address, and its browser tells by `Origin` that a page does, which no page can leave out. Beyond
that a page can send `text/xml` only after asking by OPTIONS, and carries the name in its address bar as `Host`. What
programs send was looked up or seen: rospy (Python's xmlrpc.client), roscpp 1.15.15 (XmlRpc++), MATLAB and rosjava
(Apache's ws-xmlrpc) send `Host` and `text/xml`; rosrust and roslibrust send `Host` and no type; none sends `Origin`.
"""

from collections.abc import Callable, Mapping, Sequence

from vrx_mj.errors import CommandError
from vrx_mj.ros.access import host_of
from vrx_mj.ros.ros1.http import body_size

__all__ = ["RequestError", "checked_size"]

BROWSERS_OWN = ("origin", "sec-fetch-", "access-control-request-")
"""Beginnings of fields that browsers add, and nobody else."""
TYPE = "text/xml"


class RequestError(CommandError):
    """Why a request is refused, with HTTP's status."""

    def __init__(self, status: str, why: str) -> None:
        self.status = status
        super().__init__(why)

    def __reduce__(self) -> tuple[type["RequestError"], tuple[str, str]]:
        return type(self), (self.status, str(self))


def checked_size(words: Sequence[str], fields: Mapping[str, str], is_ours: Callable[[str], bool]) -> int:
    """Bytes of a request's body; `is_ours` says whether a host in lower case is this machine.

    Raises:
        RequestError: it is no call, or a page's.
        CommandError: its body is sent in a way that is not read here, or too large.
    """
    if len(words) != 3 or words[2] not in {"HTTP/1.0", "HTTP/1.1"}:
        raise RequestError("400 Bad Request", f"this is XML-RPC: '{' '.join(words)[:60]}' is not HTTP/1.0 or 1.1")
    if words[0] != "POST":
        raise RequestError("405 Method Not Allowed", f"this is XML-RPC: '{' '.join(words)[:60]}' is not a POST")
    for name, value in fields.items():
        if name.startswith(BROWSERS_OWN):
            text = f"a web page may not call ROS, but a browser sent {name}: {ascii(value)[1:100]}"
            raise RequestError("403 Forbidden", text.removesuffix("'"))
    if "host" in fields and not is_ours(host_of(fields["host"])):
        text = "an address or name of this machine is needed; to give it another one, set ROS_HOSTNAME or ROS_IP"
        raise RequestError("421 Misdirected Request", f"invalid Host {ascii(fields['host'])[:100]}: {text}")
    kind = fields.get("content-type", TYPE)
    if kind.partition(";")[0].strip().lower() != TYPE:
        raise RequestError("415 Unsupported Media Type", f"invalid Content-Type {ascii(kind)[:100]}: {TYPE} is needed")
    size = body_size(dict(fields))
    if size is None:
        raise RequestError("411 Length Required", "a request needs a Content-Length")
    return size
