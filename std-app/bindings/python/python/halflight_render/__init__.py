"""A physically based renderer that says how wrong its picture is.

    import halflight_render as hl

    picture = hl.open("room.glb").render(error=1e-3, seconds=120)
    picture.save("room.exr")
    print(picture.relmse, picture.interval)

Pictures are arrays (rows, columns, 3) of linear sRGB. Lengths are in the units of the scene, radiance in
W/(m² sr), irradiance in W/m².
"""

from ._errors import Error, FileError, MemoryLimitError, SceneError, SettingsError
from ._halflight import Progress, version
from ._lightmap import Lightmap
from ._lights import Directional, Environment, Point, Sky, Spot
from ._materials import Material, Texture, coated, diffuse, glass, lamp, metal, mirror, pane, plastic
from ._picture import Picture
from ._points import Hits, Irradiance, read_points
from ._scene import Camera, Mesh, Scene, open
from ._settings import settings
from ._tools import Comparison, Eigen, Photons, compare, eigen, flip, read_image, save_image

__version__ = version()

__all__ = [
    "Camera",
    "Comparison",
    "Directional",
    "Eigen",
    "Environment",
    "Error",
    "FileError",
    "Hits",
    "Irradiance",
    "Lightmap",
    "Material",
    "MemoryLimitError",
    "Mesh",
    "Photons",
    "Picture",
    "Point",
    "Progress",
    "Scene",
    "SceneError",
    "SettingsError",
    "Sky",
    "Spot",
    "Texture",
    "coated",
    "compare",
    "diffuse",
    "eigen",
    "flip",
    "glass",
    "lamp",
    "metal",
    "mirror",
    "open",
    "pane",
    "plastic",
    "read_image",
    "read_points",
    "save_image",
    "settings",
]
