"""Says one of our scenes in Mitsuba's words, exactly where Mitsuba has the words.

A scene is the content of a `scene.toml` (a dictionary); its OBJ and MTL files are read from `folder`.
Materials follow the MTL conventions of the project (`docs/guide` has them), or, with `source=True`, the
`# SRC` comments that converted scenes carry: the BSDFs of the published original.
"""

import math
import os
import tempfile
from pathlib import Path

from workbench import mi, np
from wavefront import read_obj

_SCRATCH = []  # meshes on their way to Mitsuba, which takes them as files only


def mitsuba_scene(description, folder, source=False):
    """Loads the scene: the Mitsuba object, ready for `mi.render`."""
    folder = Path(folder)
    settings = description["render"]
    scene = {"type": "scene", "integrator": {"type": "path", "max_depth": settings.get("max_depth", -1)}}
    scene["sensor"] = _camera(description["camera"], settings["size"])
    textures = {}
    for mesh in description["mesh"]:
        parts, materials = read_obj(folder / mesh["file"])
        for i, part in enumerate(parts):
            material = materials[part.material]
            bsdf = source_bsdf(material, textures) if source else mtl_bsdf(material, textures)
            if description.get("material", {}).get(part.material, {}).get("kind") == "pane":
                bsdf = {"type": "thindielectric", "int_ior": material["Ni"][0], "ext_ior": 1.0}
            scene[f"mesh {len(scene)} {i}"] = _mesh(part, bsdf, material, textures)
    for i, light in enumerate(description.get("light", [])):
        scene[f"light {i}"] = _light(light)
    if "environment" in description:
        scene["environment"] = _environment(description["environment"], folder)
    try:
        return mi.load_dict(scene)
    finally:
        while _SCRATCH:
            os.remove(_SCRATCH.pop())


def _rgb(value):
    return {"type": "rgb", "value": [float(x) for x in value]}


def _camera(camera, size):
    lens = camera.get("lens_radius", 0.0)
    sensor = {
        "type": "thinlens" if lens > 0 else "perspective",
        "fov_axis": "y",
        "fov": float(camera["fov"]),
        "near_clip": 1e-3,
        "far_clip": 1e6,
        "to_world": mi.ScalarTransform4f().look_at(camera["eye"], camera["look_at"], camera["up"]),
        # The box filter is one pixel wide: pixels share no samples, as in our film.
        "film": {
            "type": "hdrfilm",
            "width": int(size[0]),
            "height": int(size[1]),
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "multijitter", "sample_count": 16},
    }
    if lens > 0:
        sensor |= {"aperture_radius": float(lens), "focus_distance": float(camera["focus_distance"])}
    return sensor


def _mesh(part, bsdf, material, textures):
    emits = any(material.get("Ke", [0.0]))
    normals = None if emits else part.normals  # emission asks for the side of the triangle, not of its vn
    with tempfile.NamedTemporaryFile(suffix=".ply", delete=False) as file:
        _SCRATCH.append(file.name)
        _write_ply(file, part, normals)
    shape = {"type": "ply", "filename": file.name, "face_normals": normals is None, "bsdf": bsdf}
    if emits:
        radiance = _rgb(material["Ke"])
        if "map_Ke" in material:
            radiance = _texture(textures, material["map_Ke"], factor=material["Ke"])
        shape["emitter"] = {"type": "area", "radiance": radiance}
    return shape


def _write_ply(file, part, normals):
    columns = {"x y z": part.positions}
    if normals is not None:
        columns["nx ny nz"] = normals
    if part.texcoords is not None:  # Mitsuba's v points down
        columns["u v"] = part.texcoords * [1, -1] + [0, 1]
    names = " ".join(columns).split()
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(part.positions)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(part.faces)}", "property list uchar int vertex_indices", "end_header", ""]
    file.write("\n".join(header).encode())
    file.write(np.hstack(list(columns.values())).astype("<f4").tobytes())
    faces = np.zeros(len(part.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, part.faces
    file.write(faces.tobytes())


def _texture(textures, path, channel=None, factor=(1.0, 1.0, 1.0), raw=False):
    """A bilinear, repeating bitmap: RGB times `factor`, or one channel (linear) as it is."""
    key = (path, channel, tuple(factor), raw)
    if key not in textures:
        bitmap = mi.Bitmap(str(path))
        is_float = bitmap.component_format() in (mi.Struct.Type.Float16, mi.Struct.Type.Float32)
        if channel is None:
            decode = not raw and not is_float
            bitmap.set_srgb_gamma(decode)
            bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
            texels = np.array(bitmap) * np.array(factor, dtype=np.float32)
        else:
            texels = np.array(bitmap.convert(component_format=mi.Struct.Type.Float32, srgb_gamma=bitmap.srgb_gamma()))
            texels = texels[:, :, channel : channel + 1] * np.float32(factor[0])
        textures[key] = mi.load_dict({"type": "bitmap", "data": mi.TensorXf(texels), "raw": True})
    return textures[key]


def _colour(material, key, textures, default=(0.0, 0.0, 0.0)):
    value = material.get(key, list(default))
    if "map_" + key in material:
        return _texture(textures, material["map_" + key], factor=value)
    return _rgb(value)


def _alpha_channel(path):
    """Which channel a map_d means: alpha where there is one, else the first."""
    channels = mi.Bitmap(str(path)).channel_count()
    return 3 if channels == 4 else 1 if channels == 2 else 0


def _finish(bsdf, material, textures, twosided):
    """Wraps a BSDF: both sides, bent normals, cut-out, from the inside to the outside."""
    for key in ("norm", "map_Bump", "bump", "map_bump"):
        if key in material and key == "norm":
            bent = _texture(textures, material[key], raw=True)
            # The shadowing term of Estevez et al. is Mitsuba's addition.
            bsdf = {"type": "normalmap", "normalmap": bent, "nested": bsdf, "use_shadowing_function": False}
    if twosided:
        bsdf = {"type": "twosided", "nested": bsdf}
    opacity = material.get("d", [1.0])[0]
    if "map_d" in material:
        channel = _alpha_channel(material["map_d"])
        cut = _texture(textures, material["map_d"], channel, factor=[opacity] * 3)
        bsdf = {"type": "mask", "opacity": cut, "nested": bsdf}
    elif opacity < 1.0:
        bsdf = {"type": "mask", "opacity": opacity, "nested": bsdf}
    return bsdf


def mtl_bsdf(material, textures):
    """The BSDF that the MTL keys mean. What Mitsuba cannot say exactly is refused."""
    number = lambda key, default: material.get(key, [default])[0]
    illum = int(number("illum", 1))
    roughness, metallic = number("Pr", -1.0), number("Pm", 0.0)
    specular, base = material.get("Ks", [0.0] * 3), material.get("Kd", [0.0] * 3)
    alpha = roughness**2 if roughness >= 0 else math.sqrt(2.0 / (number("Ns", 0.0) + 2.0))
    if illum in (4, 6, 7, 9):
        bsdf = {"type": "dielectric", "int_ior": number("Ni", 1.5), "ext_ior": 1.0}
        bsdf["specular_transmittance"] = _rgb(material.get("Tf", [1.0] * 3))
        if roughness > 0:
            bsdf |= {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha}
        return _finish(bsdf, material, textures, False)
    if illum == 3 or (metallic == 1 and roughness == 0):
        key = "Ks" if any(specular) else "Kd"
        bsdf = {"type": "conductor", "material": "none", "specular_reflectance": _colour(material, key, textures)}
    elif metallic == 1:
        # Schlick's Fresnel term over GGX: what "principled" is when it is all metal.
        colour = _colour(material, "Kd" if any(base) else "Ks", textures)
        bsdf = {"type": "principled", "metallic": 1.0, "roughness": math.sqrt(alpha), "base_color": colour}
    elif any(specular):
        ior = number("Ni", 1.5)
        if any(abs(k - ((ior - 1) / (ior + 1)) ** 2) > 1e-4 for k in specular) or metallic != 0:
            raise ValueError("Mitsuba has no coat whose Ks differs from the Fresnel reflectance of Ni")
        bsdf = {"type": "plastic", "int_ior": ior, "ext_ior": 1.0, "nonlinear": True}
        bsdf["diffuse_reflectance"] = _colour(material, "Kd", textures)
        if roughness != 0:
            bsdf |= {"type": "roughplastic", "distribution": "ggx", "alpha": alpha}
    else:
        bsdf = {"type": "diffuse", "reflectance": _colour(material, "Kd", textures)}
    return _finish(bsdf, material, textures, True)


def source_bsdf(material, textures):
    """The BSDF of the published original, from the `# SRC` comment."""
    source = material["SRC"]
    kind = source["type"]
    bsdf = {"type": kind}
    for key in ("alpha", "distribution"):
        if key in source and kind.startswith("rough"):
            bsdf[key] = source[key]
    if kind == "diffuse":
        bsdf["reflectance"] = _colour(material, "Kd", textures)
    elif kind in ("conductor", "roughconductor"):
        if source.get("material") == "none":
            bsdf["material"] = "none"
        else:
            bsdf |= {"eta": _rgb(source["eta"]), "k": _rgb(source["k"])}
        bsdf["specular_reflectance"] = _rgb(source["ks"])
        if "map_ks" in source:
            path = material["folder"] / source["map_ks"]
            bsdf["specular_reflectance"] = _texture(textures, path, factor=source["ks"])
    elif kind in ("dielectric", "roughdielectric"):
        bsdf |= {"int_ior": source["ior"], "ext_ior": 1.0}
        bsdf["specular_reflectance"] = _rgb(source["ks"])
        bsdf["specular_transmittance"] = _rgb(source["kt"])
    elif kind in ("plastic", "roughplastic"):
        bsdf |= {"int_ior": source["ior"], "ext_ior": 1.0, "nonlinear": source["nonlinear"]}
        bsdf["diffuse_reflectance"] = _colour(material, "Kd", textures)
    else:
        raise ValueError(f"no Mitsuba equivalent is known for {kind}")
    # Always on both sides, as with us: only the sides that face away from every light and eye differ.
    return _finish(bsdf, material, textures, "dielectric" not in kind)


def _light(light):
    if light["kind"] == "directional":
        return {"type": "directional", "direction": light["direction"], "irradiance": _rgb(light["irradiance"])}
    if light["kind"] == "point":
        return {"type": "point", "position": light["position"], "intensity": _rgb(light["intensity"])}
    target = np.add(light["position"], light["direction"])
    up = [0, 1, 0] if abs(light["direction"][1]) < 0.9 * np.linalg.norm(light["direction"]) else [1, 0, 0]
    return {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at(light["position"], target.tolist(), up),
        "intensity": _rgb(light["intensity"]),
        "beam_width": float(light["inner_degrees"]),
        "cutoff_angle": float(light["outer_degrees"]),
    }


def _environment(environment, folder):
    radiance = environment.get("radiance", [1.0, 1.0, 1.0])
    if "map" not in environment:
        return {"type": "constant", "radiance": _rgb(radiance)}
    texels = np.array(mi.Bitmap(str(folder / environment["map"])).convert(
        mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)) * np.array(radiance, dtype=np.float32)
    bitmap = mi.Bitmap(np.ascontiguousarray(_rows_at_half_texels(texels)))
    # Mitsuba's map has u = atan2(x, -z) / 2 pi; ours u = atan2(z, x) / 2 pi.
    to_ours = mi.ScalarTransform4f([[0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])
    turn = mi.ScalarTransform4f()
    if "rotate" in environment:
        turn = turn.rotate(environment["rotate"]["axis"], environment["rotate"]["degrees"])
    return {"type": "envmap", "bitmap": bitmap, "to_world": turn @ to_ours}


def _rows_at_half_texels(texels):
    """The same bilinear function for Mitsuba, whose first and last rows lie on the poles themselves: rows at
    multiples of half a texel, which every bilinear knot of ours is among."""
    height = len(texels)
    at = np.clip(np.arange(2 * height + 1) / 2 - 0.5, 0, height - 1)
    below = np.minimum(at.astype(int), height - 2) if height > 1 else np.zeros(len(at), int)
    fraction = (at - below)[:, None, None].astype(np.float32)
    return texels[below] * (1 - fraction) + texels[np.minimum(below + 1, height - 1)] * fraction
