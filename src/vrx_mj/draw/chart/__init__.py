"""The drawing of a map with matplotlib: a plan, and a panel with compass, legend and overview beside it."""

from typing import TYPE_CHECKING, Any

from vrx_mj.draw.chart.labels import write
from vrx_mj.draw.chart.panels import compass, legend, overview
from vrx_mj.draw.chart.plan import draw_plan, view_of

if TYPE_CHECKING:
    from vrx_mj.draw.map import MapScene

__all__ = ["chart"]

DPI = 100


def chart(scene: "MapScene", size: tuple[int, int]) -> Any:
    """The map as a matplotlib figure of `size` pixels."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.055, 0.06, 0.685, 0.875))
    view = view_of(scene, axes.get_window_extent().width / axes.get_window_extent().height)
    draw_plan(axes, scene, view)
    write(figure, 0.055, 0.955, scene.title, size=17, weight="bold", va="bottom")
    compass(figure.add_axes((0.765, 0.70, 0.215, 0.235)), scene)
    legend(figure.add_axes((0.765, 0.33, 0.215, 0.34)), scene)
    overview(figure.add_axes((0.765, 0.06, 0.215, 0.24)), scene, view)
    canvas.draw()
    return figure
