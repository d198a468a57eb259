"""`vrx-mj teleop`: drives a world that `vrx-mj serve` serves."""

from typing import Annotated

import typer

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.packages import needs_extra

__all__ = ["teleop"]

DEFAULT_URL = "ws://127.0.0.1:9090"


def teleop(
    boat: Annotated[str | None, typer.Option(help="The boat to drive at first; default: the first one.")] = None,
    url: Annotated[str, typer.Option(help="Address of the rosbridge.")] = DEFAULT_URL,
    web: Annotated[int | None, typer.Option(help="Serve a page to drive from; the port may be left out: 8090.")] = None,
) -> None:
    """Drive a boat of a served world. The keys are those of VRX; --web serves a page to drive from.

    Example: vrx-mj teleop --boat wamv2
    """
    from importlib.util import find_spec

    if find_spec("websockets") is None:
        raise NetworkError(needs_extra("vrx-mj teleop", "websockets", "rosbridge"))
    if web is not None:
        _serve_page(web, url, boat)
        return
    if "://" not in url:
        raise CommandError(f"invalid --url '{url}': ws://HOST:PORT is needed, as in {DEFAULT_URL}")
    from vrx_mj.ros.teleop.driving import drive

    drive(url, boat=boat)


def _serve_page(port: int, url: str, boat: str | None) -> None:
    import contextlib
    from urllib.parse import urlsplit

    from vrx_mj.ros.teleop.web import PageServer, reaches

    with PageServer(port, url, boat) as server, contextlib.suppress(KeyboardInterrupt):
        ports = (server.server_address[1], urlsplit(url).port or 80)
        tunnel = " ".join(f"-L {number}:127.0.0.1:{number}" for number in ports)
        typer.echo(f"Open {server.page}")
        typer.echo(f"It drives the world at {url}, and is for this machine only. Ctrl-C stops.")
        typer.echo(f"From another machine, first: ssh {tunnel} this-machine")
        if not reaches(url):
            typer.echo(f"nothing answers at {url} yet; start a world there: vrx-mj serve WORLD --rosbridge", err=True)
        server.serve_forever(poll_interval=0.2)
