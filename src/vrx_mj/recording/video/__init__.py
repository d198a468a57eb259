"""Draw a recording into a video without a display: MP4, WebP or GIF. Encoders are loaded when they are used."""

from vrx_mj.recording.video.filming import VIEWS, Film, Shot, draw_video, parse_size, write_video
from vrx_mj.recording.video.stage import Eye, looking

__all__ = ["VIEWS", "Eye", "Film", "Shot", "draw_video", "looking", "parse_size", "write_video"]
