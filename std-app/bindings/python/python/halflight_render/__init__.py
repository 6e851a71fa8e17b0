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
from ._picture import Picture
from ._points import Hits, Irradiance, read_points
from ._scene import (
    Camera,
    Directional,
    Material,
    Mesh,
    Point,
    Scene,
    Spot,
    coated,
    diffuse,
    glass,
    lamp,
    metal,
    mirror,
    open,
    pane,
)
from ._settings import settings
from ._tools import Comparison, Eigen, Photons, compare, eigen, flip, read_image, save_image

__version__ = version()

__all__ = [
    "Camera",
    "Comparison",
    "Directional",
    "Eigen",
    "Error",
    "FileError",
    "Hits",
    "Irradiance",
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
    "Spot",
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
    "read_image",
    "read_points",
    "save_image",
    "settings",
]
