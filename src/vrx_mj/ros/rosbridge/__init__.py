"""rosbridge v2: the table for browsers, scripts and MATLAB, as JSON and CBOR over websockets."""

from vrx_mj.ros.rosbridge.server import Rosbridge

__all__ = ["Rosbridge"]
