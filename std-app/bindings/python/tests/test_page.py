"""The documentation page: its programs run from top to bottom as they are, in small."""

import re
from pathlib import Path

import pytest
from conftest import ROOT

import halflight_render as hl

PAGE = ROOT / "docs" / "python.md"
EXTRAS = {"daylight": "pyradiance", "denoising": "pyoidn"}


def blocks():
    """Indented blocks of Python, with the heading above."""
    for part in re.split(r"^## ", PAGE.read_text(), flags=re.M)[1:]:
        heading, text = part.split("\n", 1)
        for block in re.findall(r"(?:^    .*\n|^\n(?=    ))+", text, flags=re.M):
            code = re.sub(r"^    ", "", block, flags=re.M)
            if not re.match(r"\s*(pip|cd|honeybee)", code) and "point_in_time(" not in code:
                yield heading, code


def test_programs_of_the_page_run(tmp_path, monkeypatch):
    for module in EXTRAS.values():
        pytest.importorskip(module)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("builtins.print", lambda *_, **__: None)
    render, irradiance, bake = hl.Scene.render, hl.Scene.irradiance, hl.Scene.bake_lightmap

    def small(scene, *, size=None, spp=4, **settings):
        few = {name: settings[name] for name in settings if name not in ("error", "seconds")}
        return render(scene, size=(32, 24), spp=min(spp, 8), **few)

    monkeypatch.setattr(hl.Scene, "render", small)
    monkeypatch.setattr(hl.Scene, "irradiance", lambda scene, *points, **_: irradiance(scene, *points, spp=8))
    monkeypatch.setattr(hl.Scene, "bake_lightmap", lambda scene, size, of, **_: bake(scene, (16, 16), of, spp=4))
    Path("desk.pts").write_text("0 0.5 0 0 1 0\n0.2 0.5 0 0 1 0\n")
    Path("office.rad").write_text(
        "void plastic white 0 0 5 .7 .7 .7 0 0\nwhite polygon floor 0 0 12  0 0 0  4 0 0  4 6 0  0 6 0\n"
    )
    room = {'"room.glb"': repr(str(ROOT / "scenes" / "lightmap" / "room.toml")), '"floor", error': '"white", error'}
    names = {}
    ran = []
    for heading, code in blocks():
        for old, new in room.items():
            code = code.replace(old, new)
        exec(compile(code, f"{PAGE}: {heading}", "exec"), names)  # noqa: S102
        ran.append(heading)
    assert {"A picture", "Layers", "Synthetic data", "Many views", "A scene from arrays"} <= set(ran)
    assert {"Irradiance of points", "Lightmaps", "Denoised pictures", "Progress and interruption"} <= set(ran)
    assert len(ran) >= 11
