"""Scenes from arrays: repairs, refusals, rays, and irradiance."""

import numpy as np
import pytest
from conftest import SQUARE, TRIANGLES, sky_floor

import halflight_render as hl


def test_arrays_make_the_scene_of_a_file(tmp_path):
    lines = [f"v {x} {y} {z}" for x, y, z in SQUARE] + ["usemtl floor", "f 1 2 3", "f 1 3 4"]
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + "\n".join(lines) + "\n")
    (tmp_path / "a.mtl").write_text("newmtl floor\nKd 0.5 0.5 0.5\n")
    (tmp_path / "a.toml").write_text(
        '[[mesh]]\nfile = "a.obj"\n[[light]]\nkind = "point"\nposition = [0, 2, 0]\nintensity = 10\n'
    )
    settings = {"spp": 4, "size": (32, 32), "method": "path", "eye": (0, 2, 3), "look_at": (0, 0, 0)}
    of_file = hl.open(tmp_path / "a.toml").render(**settings)
    floor = hl.Mesh(SQUARE, TRIANGLES, hl.diffuse(0.5))
    of_arrays = hl.Scene([floor], [hl.Point((0, 2, 0), 10)]).render(**settings)
    assert np.array_equal(of_file.image, of_arrays.image)
    assert of_arrays.image.max() > 0


def test_a_scene_without_light_has_a_note():
    def is_noted(scene):
        return any("nothing in this scene emits light" in note for note in scene.notes)

    assert is_noted(hl.Scene([hl.Mesh(SQUARE, TRIANGLES)]))
    assert not is_noted(sky_floor())


def test_every_material_and_light_renders():
    materials = [
        hl.diffuse((0.5, 0.4, 0.3)),
        hl.mirror(),
        hl.metal(0.9, 0.3),
        hl.coated(0.5, 0.2, ior=1.5),
        hl.glass(1.5, 0.2),
        hl.pane(tint=(0.9, 1, 0.9)),
        hl.lamp(2.0),
        hl.diffuse(0.5).emitting(1.0, two_sided=True),
    ]
    lights = [
        hl.Point((0, 3, 0), 5),
        hl.Spot((0, 3, 0), (0, 0, 0), 5, angle=30, inner_angle=10),
        hl.Directional((0, -1, 0), 1),
    ]
    for material in materials:
        mesh = hl.Mesh(SQUARE, TRIANGLES, material)
        below = hl.Mesh(SQUARE * 2 - [0, 1, 0], TRIANGLES)
        camera = hl.Camera((0, 2, 3), (0, 0, 0), fov=40)
        scene = hl.Scene([mesh, below], lights, environment=0.1, camera=camera)
        image = scene.render(spp=4, size=(16, 16)).image
        assert np.isfinite(image).all() and image.max() > 0, material


def test_layouts_of_arrays_do_not_matter():
    plain = sky_floor().render(spp=2, size=(16, 16), method="path").image
    camera = hl.Camera(eye=(0, 2, 3), look_at=(0, 0, 0), fov=40)
    for positions, triangles in (
        (np.asfortranarray(SQUARE), TRIANGLES.astype(np.uint8)),
        (SQUARE.astype(np.float32), TRIANGLES.tolist()),
        (np.repeat(SQUARE, 2, axis=0)[::2], TRIANGLES.astype(">i8")),
        (SQUARE.tolist(), np.asfortranarray(TRIANGLES)),
    ):
        floor = hl.Mesh(positions, triangles, hl.diffuse(0.5), name="floor")
        scene = hl.Scene([floor], environment=1.0, camera=camera)
        assert np.array_equal(scene.render(spp=2, size=(16, 16), method="path").image, plain)


def test_faulty_meshes_are_repaired_with_a_note():
    triangles = np.vstack([TRIANGLES, [[0, 0, 1]]])
    normals = np.tile([0.0, 2.0, 0.0], (4, 1))
    scene = hl.Scene([hl.Mesh(SQUARE, triangles, normals=normals)], environment=1.0)
    assert len(scene.triangles) == 2
    assert any("triangle" in note for note in scene.notes)


@pytest.mark.parametrize(
    ("mesh", "problem"),
    [
        ({"triangles": [[0, 1, 4]]}, "triangle 0 refers to a vertex that does not exist"),
        ({"triangles": [[0, 1, -1]]}, "indices of 0 and above"),
        ({"triangles": [[0.5, 1, 2]]}, "whole numbers"),
        ({"triangles": [[0, 1]]}, "(n, 3) is expected"),
        ({"positions": SQUARE[:, :2]}, "(n, 3) is expected"),
        ({"normals": SQUARE[:2]}, "2 normals and 4 positions"),
        ({"texcoords": SQUARE}, "(n, 2) is expected"),
    ],
)
def test_wrong_arrays_are_refused_with_the_name_of_the_mesh(mesh, problem):
    parts = {"positions": SQUARE, "triangles": TRIANGLES} | mesh
    with pytest.raises(hl.Error) as refused:
        hl.Scene([hl.Mesh(name="floor", **parts)])
    assert problem in str(refused.value) and "floor" in str(refused.value)
    assert isinstance(refused.value, ValueError)


def test_senseless_quantities_are_refused():
    for make in (
        lambda: hl.diffuse(1.5),
        lambda: hl.metal(0.5, roughness=2),
        lambda: hl.lamp(-1),
        lambda: hl.glass(ior=0),
        lambda: hl.diffuse((0.5, 0.5)),
        lambda: hl.Scene([], camera=hl.Camera(eye=(0, 0, 0), look_at=(0, 0, 0))),
        lambda: hl.Scene([], lights=[hl.Directional((0, 0, 0), 1)]),
        lambda: hl.Scene([hl.Mesh(SQUARE, TRIANGLES, hl.Material("marble"))]),
    ):
        with pytest.raises(hl.Error):
            make()


def test_rays_meet_the_plane_where_geometry_says(floor):
    generator = np.random.default_rng(1)
    x, z = generator.uniform(-0.99, 0.99, (2, 500))
    targets = np.column_stack([x, np.zeros(500), z])
    origins = targets + generator.normal(size=(500, 3)) * [3, 0, 3] + [0, 5, 0]
    hits = floor.trace(origins, 2 * (targets - origins))
    assert hits.hit.all() and len(hits) == 500
    assert hits.t == pytest.approx(0.5, rel=1e-5)
    assert hits.normal == pytest.approx(np.tile([0, 1, 0], (500, 1)))
    corners = floor.positions[floor.triangles[hits.triangle]]
    u, v = hits.weights.T
    points = (1 - u - v)[:, None] * corners[:, 0] + u[:, None] * corners[:, 1] + v[:, None] * corners[:, 2]
    assert points == pytest.approx(targets, abs=1e-5)
    assert floor.occluded(origins, 2 * (targets - origins)).all()
    assert not floor.occluded(origins, 2 * (targets - origins), 0.49).any()
    missed = floor.trace([[0, 1, 0]], [[0, 1, 0]])
    assert missed.triangle[0] == -1 and np.isinf(missed.t[0]) and np.isnan(missed.normal).all()


def test_irradiance_below_a_white_sky_is_pi(floor):
    points = np.column_stack([np.linspace(-0.5, 0.5, 100), np.full(100, 1e-3), np.zeros(100)])
    found = floor.irradiance(points, (0, 1, 0), spp=256)
    assert found.value == pytest.approx(np.pi, rel=0.02)
    assert (found.lower <= found.upper).all() and found.valid.all()
    assert (found.samples >= 256).all() and len(found) == 100
    assert found.lux == pytest.approx(179 * np.pi, rel=0.02)
    assert found.rgb.shape == (100, 3) and found.rgb.base is not None


def test_irradiance_stops_at_its_error_and_samples_determine_its_bits(cornell):
    low, high = np.array(cornell.bounds)
    generator = np.random.default_rng(2)
    points = generator.uniform(low + 0.2 * (high - low), high - 0.2 * (high - low), (64, 3))
    found = cornell.irradiance(points, (0, 1, 0), error=0.1)
    width = 0.5 * (found.upper - found.lower)
    assert np.mean(width <= 0.1 * (found.value + 0.1 * found.value.mean()) * 1.001) >= 0.9
    # Rounds follow the clock, so that an error is reached with more samples or fewer.
    first, again = (cornell.irradiance(points, (0, 1, 0), spp=32, threads=threads) for threads in (1, 2))
    assert np.array_equal(first.rgb, again.rgb) and np.array_equal(first.upper, again.upper)


def test_points_are_read_from_files_of_sensors(tmp_path):
    (tmp_path / "a.pts").write_text("0 1 2 0 1 0\n3 4 5 0 0 -1\n")
    points, normals = hl.read_points(tmp_path / "a.pts")
    assert points.tolist() == [[0, 1, 2], [3, 4, 5]] and normals.tolist() == [[0, 1, 0], [0, 0, -1]]
    (tmp_path / "b.pts").write_text("0 1 2\n")
    with pytest.raises(hl.FileError, match="line 1"):
        hl.read_points(tmp_path / "b.pts")


def test_points_that_do_not_fit_are_refused(floor):
    for points, normals in (
        (np.zeros((2, 3)), np.ones((3, 3))),
        ([[0, 0, np.nan]], (0, 1, 0)),
        ([[0, 0, 0]], (0, 0, 0)),
        (np.zeros((0, 3)), np.zeros((0, 3))),
    ):
        with pytest.raises(hl.Error):
            floor.irradiance(points, normals, spp=4)


#: Texture coordinates of the square, whose first corner is at the top left of a picture.
UV = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])

#: A picture of four fields.
FIELDS = np.array([[[0.9, 0.1, 0.1], [0.1, 0.9, 0.1]], [[0.1, 0.1, 0.9], [0.5, 0.5, 0.5]]])


def above(material, **keywords):
    """A square with texture coordinates below a white sky, seen from above with its first corner at the top left."""
    floor = hl.Mesh(SQUARE, TRIANGLES, material, texcoords=UV, name="floor")
    camera = hl.Camera(eye=(0, 3, 0), look_at=(0, 0, 0), up=(0, 0, -1), fov=2 * np.degrees(np.arctan(1 / 3)))
    return hl.Scene([floor], environment=1.0, camera=camera, **keywords)


def seen(scene, **keywords):
    return scene.render(spp=64, size=(8, 8), method="path", reconstruct=False, **keywords).image


def enlarged(picture, times):
    return np.kron(picture, np.ones((times, times, 1)))


def test_textures_have_their_first_pixel_at_the_top_left():
    # 16 texels a field: all but the edges of fields are constant.
    image = seen(above(hl.diffuse(enlarged(FIELDS, 16))))
    for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):
        field = image[4 * row + 1 : 4 * row + 3, 4 * column + 1 : 4 * column + 3]
        # A floor below a white sky shows its reflectance.
        assert field == pytest.approx(np.broadcast_to(FIELDS[row, column], (2, 2, 3)), rel=0.03)


def test_bytes_are_in_the_srgb_curve():
    half = np.full((4, 4, 3), 188, np.uint8)
    assert seen(above(hl.diffuse(half))) == pytest.approx(0.5029, rel=0.02)
    grey = np.full((4, 4), 188, np.uint8)
    assert seen(above(hl.diffuse(grey))) == pytest.approx(0.5029, rel=0.02)


def test_every_input_of_a_material_may_be_a_texture():
    ones = np.ones((4, 4), np.float32)
    plain = seen(above(hl.coated(0.5, 0.4, specular=0.1, metallic=0.3)))
    mapped = hl.coated(0.5 * ones, 0.4 * ones, specular=0.1 * ones, metallic=0.3 * ones)
    assert seen(above(mapped)) == pytest.approx(plain, rel=1e-4)
    lamp = seen(above(hl.lamp(enlarged(3 * FIELDS, 16))))
    assert lamp[1, 1] == pytest.approx(3 * FIELDS[0, 0], rel=1e-4)
    # Rays that pass the holes see the white sky.
    holes = seen(above(hl.diffuse(0.2).cut_out(enlarged(np.array([[[0.0], [1.0]]]), 16)[..., 0])))
    assert holes[4, 1] == pytest.approx(1, rel=1e-3) and holes[4, 6] == pytest.approx(0.2, rel=0.05)


def test_normal_and_height_maps_turn_the_normal():
    # 45 degrees towards +u, which is +x.
    normals = np.broadcast_to([0.5 + 0.5 * np.sqrt(0.5), 0.5, 0.5 + 0.5 * np.sqrt(0.5)], (4, 4, 3))
    ramp = np.tile(np.linspace(1, 0, 64), (64, 1))
    for material in (hl.diffuse(0.5).with_normals(normals), hl.diffuse(0.5).bumped(ramp, 0.5)):
        layers = above(material).render(spp=4, size=(9, 9), layers=["normal"])
        x, y, z = layers.normal[4, 4]
        assert x > 0.3 and y > 0.5 and abs(z) < 0.05


def test_textures_are_repaired_with_notes():
    broken = np.full((4, 4, 3), 0.5, np.float32)
    broken[0, 0] = [np.nan, -1, 0.5]
    scene = above(hl.diffuse(broken))
    assert any("color of material 0" in note and "NaN or negative are set to 0, 2 times" in note for note in scene.notes)
    assert np.isfinite(seen(scene)).all()


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: hl.diffuse(np.full((4, 4, 3), 2.0)), "reflectance has values up to 2"),
        (lambda: hl.diffuse(np.zeros((4, 4, 4))), r"reflectance has the shape \(4, 4, 4\).*opacity"),
        (lambda: hl.diffuse(np.zeros((4, 4, 3), int)), "reflectance is of type int64"),
        (lambda: hl.metal(0.5, np.zeros((4, 4, 3))), r"roughness has the shape \(4, 4, 3\)"),
        (lambda: hl.metal(0.5, (0.1, 0.2)), "roughness is"),
        (lambda: hl.diffuse("red"), "reflectance is 'red'"),
        (lambda: hl.Material("wood"), "kind='wood': expected one of"),
        (lambda: hl.Scene([], environment=np.zeros((2, 4, 3), np.uint8)), "environment has bytes"),
        (lambda: hl.Scene([], environment=hl.Environment(np.ones((2, 4, 3)), to_world=np.ones((3, 3)))), "to_world"),
        (lambda: hl.Scene([], ["lamp"]), "lights have a str"),
    ],
)
def test_errors_name_the_argument(make, problem):
    with pytest.raises(hl.SettingsError, match=problem):
        make()


def test_environments_are_pictures_of_all_directions():
    # The upper half is white, the lower one black: the floor receives the light of the upper half.
    picture = np.zeros((32, 64, 3))
    picture[:16] = 1.0
    mesh = hl.Mesh(SQUARE, TRIANGLES, hl.diffuse(0.5))
    up = hl.Scene([mesh], environment=picture).irradiance([[0, 0, 0]], [[0, 1, 0]], spp=1024)
    assert up.value[0] == pytest.approx(np.pi, rel=0.02)
    # Turned by half a circle about x.
    turned = hl.Environment(picture, radiance=2.0, to_world=np.diag([1.0, -1.0, -1.0]))
    down = hl.Scene([mesh], environment=turned).irradiance([[0, 0, 0], [0, -1, 0]], [[0, 1, 0], [0, -1, 0]], spp=1024)
    assert down.value == pytest.approx([0, 2 * np.pi], rel=0.02, abs=0.05)


def test_skies_are_those_of_scene_files(tmp_path):
    lines = [f"v {x} {y} {z}" for x, y, z in SQUARE] + ["f 1 2 3", "f 1 3 4"]
    (tmp_path / "a.obj").write_text("\n".join(lines) + "\n")
    place = 'date = "2026-06-21"\ntime = "12:00+00:00"\nlatitude = 47\nlongitude = 8\n'
    (tmp_path / "a.toml").write_text('[[mesh]]\nfile = "a.obj"\n[sky]\nturbidity = 4\n' + place)
    sky = hl.Sky(date="2026-06-21", time="12:00+00:00", latitude=47, longitude=8, turbidity=4)
    mesh = hl.Mesh(SQUARE, TRIANGLES)
    given = ([[0, 0.5, 0]], [[0, 1, 0]])
    by_file, by_array = (
        scene.irradiance(*given, spp=64).value[0] for scene in (hl.open(tmp_path / "a.toml"), hl.Scene([mesh], environment=sky))
    )
    assert by_file == by_array > 100
    for sky, problem in (
        (hl.Sky(), "position of the sun is unknown"),
        (hl.Sky(sun=(0, -1, 0)), "below the horizon"),
        (hl.Sky(date="noon", time="12:00Z", latitude=1, longitude=1), "^date of the sky: the calendar"),
        (hl.Sky(sun=(0, 1, 0), turbidity=90), "^turbidity of the sky: "),
    ):
        with pytest.raises(hl.SceneError, match=problem):
            hl.Scene([mesh], environment=sky)


def test_panes_pass_light_and_plastic_has_a_coat():
    window = hl.Mesh(SQUARE + [0, 1, 0], TRIANGLES, hl.pane(1.5, tint=0.5))
    floor = hl.Mesh(SQUARE * 0.1, TRIANGLES, hl.diffuse(0.5))
    lit = hl.Scene([window, floor], [hl.Directional((0, -1, 0), 1.0)]).irradiance([[0, 0, 0]], [[0, 1, 0]], spp=64)
    # Two faces of reflectance 0.04 with a body of transmittance 0.5 between: 0.96² · 0.5 / (1 - 0.04² · 0.5²).
    assert lit.value[0] == pytest.approx(0.96**2 * 0.5 / (1 - 0.0004), rel=1e-3)
    shiny = hl.plastic(0.2, ior=1.5)
    assert shiny.specular == pytest.approx([0.04] * 3) and shiny.ior == 1.5
