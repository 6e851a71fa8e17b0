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
