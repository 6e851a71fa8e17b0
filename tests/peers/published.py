"""The published scenes (a folder outside of this repository) as `scene.toml` descriptions."""

import json
import os
from pathlib import Path

import numpy as np

if "HALFLIGHT_SCENES" not in os.environ:
    raise SystemExit("name the folder of the published scenes in HALFLIGHT_SCENES (see README.md beside this script)")
SCENES = Path(os.environ["HALFLIGHT_SCENES"])


def published(name, size, limit_depth=False):
    """Description of scene `name` with absolute paths, at `size` (width, height); `limit_depth` keeps the
    longest path of the original (counted alike: 2 is direct light)."""
    folder = SCENES / name
    facts = json.loads((folder / f"{name}.json").read_text())
    camera = facts["camera"]
    description = {
        "render": {"size": list(size)},
        "mesh": [{"file": str(folder / f"{name}.obj")}],
        "camera": {"eye": camera["origin"], "look_at": camera["target"], "up": camera["up"], "fov": camera["vfov"]},
    }
    if limit_depth:
        integrator = facts["integrator"]
        description["render"]["max_depth"] = int(integrator.get("max_depth", integrator.get("maxdepth", 65)))
    for light in facts["lights"]:
        if light["type"] == "spot":
            # Of pbrt: a cone of 30 degrees that fades over its last 5.
            cone = {"outer_degrees": 30.0, "inner_degrees": 25.0}
            direction = [to - at for to, at in zip(light["to"], light["from"])]
            place = {"position": light["from"], "direction": direction, "intensity": [light["scale"]] * 3}
            description.setdefault("light", []).append({"kind": "spot", **place, **cone})
            continue
        if light["type"] == "directional":
            sun = {"direction": light["direction"], "irradiance": light["irradiance"]}
            description.setdefault("light", []).append({"kind": "directional", **sun})
            continue
        if light["type"] != "envmap":
            raise ValueError(f"{name}: no description for a light of type {light['type']}")
        # Their map has u = atan2(x, -z) / 2 pi (Mitsuba's envmap), ours u = atan2(z, x) / 2 pi.
        to_world = np.array(light["to_world"])[:3, :3] @ np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
        turn = float(np.degrees(np.arctan2(to_world[0, 2], to_world[0, 0])))
        rotate = {"axis": [0.0, 1.0, 0.0], "degrees": turn}
        description["environment"] = {"map": str(folder / light["filename"]), "rotate": rotate}
    return description
