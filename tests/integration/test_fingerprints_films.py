"""What films show, but for what OpenGL makes of it, and what they are drawn from: what they had before."""

import numpy as np
import pytest

import vrx_mj
from fingerprints import check
from integration.test_fingerprints_recordings import PROCESSORS, by_root, colors_of, numbers_of, world_of
from vrx_mj.recording import exports
from vrx_mj.recording.video import Film, Shot, stage

SIZE = (192, 108)
SHOTS = {
    "pond": Shot(speed=2.0),
    "windy": Shot(view="above", boat="b", begin=0.2, fps=3.0),
    "fog": Shot(view="chase", boat="b", captions=False, end=0.5),
}
"""How two boats are filmed in a world."""


class Canvas:
    """Notes what it is to draw, and draws a ramp that has a hole where a sky shows."""

    seen: list[object]

    def __init__(self, model, **options):
        self.model = model
        self.seen = [options, model.mesh_facenum, model.skin_facenum, model.mesh_face, model.tex_data[::97]]

    def draw(self, data, view, skins, out):
        shapes = [data.geom_xpos, data.geom_xmat, self.model.geom_rgba, view]
        self.seen += [shapes, *([skin.vertices, skin.palette] for skin in skins)]
        height, width = out.shape[:2]
        rows, columns = np.indices((height, width))
        out[:] = ((rows * columns)[..., None] // (5, 3, 7, 1) % 251).astype(np.uint8) | np.uint8(1)
        out[height // 2 :, width // 3 :] = 0

    def close(self):
        """Nothing is open."""


@pytest.mark.parametrize("name", SHOTS)
def test_a_film_shows_what_it_showed(name, tmp_path, monkeypatch):
    sim = vrx_mj.Simulation(world_of(name), seed=3)
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        for _ in range(3):
            sim.command_all({boat: dict.fromkeys(sim.command_names(boat), 0.8) for boat in sim.boats})
            sim.advance(round(0.3 / sim.timestep))
            sim.event("done", "WARN")
    columns = {path: rows for path, rows in numbers_of(tmp_path / "run.rrd").items() if not PROCESSORS.match(path)}
    check("recordings", f"filmed: {name}", **by_root(columns), colors=colors_of(columns))
    record = vrx_mj.read_record(tmp_path / "run.rrd")
    tables = {name: table.to_pydict() for name, table in exports.read(record).items()}
    tracks = [tmp_path / f"track{suffix}" for suffix in (".gpx", ".geojson") if name == "pond"]
    rows = [exports.write_table(record.path, path) for path in tracks]
    check("recordings", f"tables: {name}", **tables, rows=rows, tracks=[path.read_text("utf-8") for path in tracks])
    monkeypatch.setattr(stage, "Canvas", Canvas)
    film = Film(record, SHOTS[name], size=SIZE, fps=5.0)
    shown = [film.picture(time) for time in film.times[:: max(1, len(film.times) - 1)]]
    (drawn,) = film._stages.values()
    check("films", name, times=film.times, radii=drawn.radii, drawn=drawn._canvas.seen)
    blocks = [picture.reshape(12, SIZE[1] // 12, 16, SIZE[0] // 16, 3).mean(axis=(1, 3)) for picture in shown]
    check("films", f"{name}: pictures", rounding=1e-5, blocks=blocks)  # letters differ between versions of FreeType
