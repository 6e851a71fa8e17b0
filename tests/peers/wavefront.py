"""Reads the OBJ and MTL files of the comparison: triangles only, as the converted scenes and ours are."""

import json
from pathlib import Path

import numpy as np


class Part:
    """The triangles of one material that agree on what their corners carry."""

    def __init__(self, material, positions, texcoords, normals, faces):
        self.material = material
        self.positions = positions
        self.texcoords = texcoords
        self.normals = normals
        self.faces = faces


def read_obj(path):
    """Parts of an OBJ file and its materials (`read_mtl`)."""
    path = Path(path)
    streams = {"v": [], "vt": [], "vn": []}
    corners = {}  # (material, has vt, has vn) -> tokens, three to a face
    materials, material = {}, None
    for line in path.read_text().splitlines():
        words = line.split()
        if not words:
            continue
        key, values = words[0], words[1:]
        if key in streams:
            streams[key].append(values)
        elif key == "f":
            if len(values) != 3:
                raise ValueError(f"{path}: a face of {len(values)} corners; triangulate first")
            kind = [len(values[0].split("/")) > i and values[0].split("/")[i] != "" for i in (1, 2)]
            corners.setdefault((material, *kind), []).extend(values)
        elif key == "usemtl":
            material = " ".join(values)
        elif key == "mtllib":
            materials.update(read_mtl(path.parent / " ".join(values)))
    v, vt, vn = (np.array(s, dtype=np.float64) if s else None for s in streams.values())
    return [_part(key, tokens, v, vt, vn) for key, tokens in corners.items()], materials


def _part(key, tokens, v, vt, vn):
    material, has_texcoords, has_normals = key
    index_of = {}
    faces = np.array([index_of.setdefault(token, len(index_of)) for token in tokens]).reshape(-1, 3)
    indices = [[int(i) if i else 0 for i in (token + "//").split("/")[:3]] for token in index_of]
    column = lambda stream, i: stream[[n[i] - 1 if n[i] > 0 else n[i] for n in indices]]
    positions = column(v, 0)
    edges = positions[faces[:, 1:]] - positions[faces[:, :1]]
    faces = faces[np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) > 0]
    texcoords = column(vt, 1)[:, :2] if has_texcoords else None
    return Part(material, positions, texcoords, column(vn, 2) if has_normals else None, faces)


def read_mtl(path):
    """Materials by name: numbers as lists, maps as absolute paths, `SRC` as the object in the comment."""
    path = Path(path)
    materials, material = {}, None
    for line in path.read_text().splitlines():
        words = line.split()
        if line.startswith("# SRC"):
            material["SRC"] = json.loads(line[5:])
        elif not words or words[0].startswith("#"):
            continue
        elif words[0] == "newmtl":
            material = materials.setdefault(" ".join(words[1:]), {"folder": path.parent})
        elif words[0].startswith("map_") or words[0] in ("norm", "bump"):
            options, name = words[1:-1], words[-1]
            material[words[0]] = path.parent / name
            if options:
                material[words[0] + " options"] = options
        else:
            material[words[0]] = [float(word) for word in words[1:]]
    return materials
