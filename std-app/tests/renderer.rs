//! The owner of a loaded scene: many views of one build, and scenes from arrays.

use core::sync::atomic::{AtomicBool, Ordering};
use halflight::Renderer;
use halflight::bake::{BakeProgress, BakeSettings, Sensor};
use halflight::load::{LoadOptions, PartMesh, SceneParts, View, load};
use halflight::render::{self, Ending, Method, Reconstruct, RenderResult, Settings, Stop};
use halflight_core::Rgb;
use halflight_core::scene::{Material, PointLight};

const CORNELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.obj");

fn settings(method: Method, spp: u32) -> Settings {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    Settings { method: Some(method), width: 48, height: 32, stop, ..Settings::default() }
}

/// Renders of views of one build, and of as many builds.
fn both(method: Method) -> Vec<[RenderResult; 2]> {
    let loaded = load(CORNELL.as_ref(), &LoadOptions::default()).unwrap();
    let renderer = Renderer::new(loaded.clone(), None).unwrap();
    let settings = settings(method, 4);
    let views = loaded.views();
    let pair = |i: u8| {
        let eye = [0.1 * f64::from(i), 1.0, 3.5];
        let view = View { eye, look_at: [0.0, 1.0, 0.0], up: [0.0, 1.0, 0.0] };
        let camera = renderer.camera(view, 40.0).unwrap();
        let never = AtomicBool::new(false);
        let owned = renderer.render_with(camera, &settings, &mut |_| {}, &never).unwrap();
        let alone = render::render(&views.scene(camera), &settings, &mut |_| {}, &never).unwrap();
        [owned, alone]
    };
    (0..3).map(pair).collect()
}

#[test]
fn views_of_one_build_have_the_bits_of_builds_of_their_own() {
    for method in [Method::Path, Method::IrradianceCache, Method::VertexMerging] {
        let pictures = both(method);
        assert!(pictures.iter().all(|[owned, alone]| owned.image == alone.image), "{method:?}");
        assert!(pictures[0][0].image != pictures[1][0].image, "{method:?}");
    }
}

#[test]
fn all_views_share_one_build() {
    let renderer = Renderer::open(CORNELL).unwrap();
    let seconds = renderer.build_seconds();
    let [first, second] = [1, 2].map(|spp| renderer.render(&settings(Method::Path, spp)).unwrap());
    assert_eq!([first.seconds.build, second.seconds.build], [seconds; 2]);
}

#[test]
fn two_threads_render_at_once() {
    let renderer = Renderer::open(CORNELL).unwrap();
    let alone = renderer.render(&settings(Method::Path, 8)).unwrap().image;
    std::thread::scope(|scope| {
        let spawn = || scope.spawn(|| renderer.render(&settings(Method::Path, 8)).unwrap().image);
        for thread in [spawn(), spawn()] {
            assert!(thread.join().unwrap() == alone);
        }
    });
}

#[test]
fn the_last_picture_of_the_progress_is_the_result_and_a_flag_ends_the_render() {
    let renderer = Renderer::open(CORNELL).unwrap();
    let (stop, mut last) = (AtomicBool::new(false), None);
    let camera = renderer.scene().camera_or_default();
    let result = renderer.render_with(
        camera,
        &Settings { reconstruct: Reconstruct::Off, ..settings(Method::Path, 1 << 20) },
        &mut |progress| {
            last = progress.picture();
            stop.store(progress.spp >= 8, Ordering::Relaxed);
        },
        &stop,
    );
    let result = result.unwrap();
    assert_eq!(result.ending, Ending::Interrupted);
    assert!(result.spp < 1 << 20 && last == Some(result.image));
}

#[test]
fn sensors_have_the_coordinates_of_the_files() {
    let mut parts = SceneParts::default();
    let lamp = parts.material("lamp", Material::lamp(Rgb::splat(10.0)));
    // A square of side 1 above two sensors, far from the origin.
    let positions = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, z]| [100.0 + x, 2.0, z]);
    let mesh = PartMesh { positions: &positions, triangles: &[[0, 1, 2], [0, 2, 3]], ..PartMesh::default() };
    parts.mesh("lamp", &mesh, lamp).unwrap();
    let renderer = Renderer::new(parts.build().unwrap(), None).unwrap();
    let sensors = [100.0, 101.0].map(|x| Sensor { position: [x, 0.0, 0.0], normal: [0.0, 1.0, 0.0] });
    let stop = Stop { spp: Some(1024), ..Stop::default() };
    let settings = BakeSettings { stop, ..BakeSettings::default() };
    let baked = renderer.irradiance_at(&sensors, &settings).unwrap();
    // Form factor of the square times π and its radiance, within twice the half-width of the interval.
    for (point, exact) in baked.values.iter().zip([2.3084, 1.5558]) {
        assert!((point.value() - exact).abs() <= point.upper - point.lower, "{point:?}, exact {exact}");
    }
}

#[test]
fn a_bake_that_is_ended_at_its_first_report_has_values_of_all_points() {
    let renderer = Renderer::new(square().build().unwrap(), None).unwrap();
    let sensor = |i: u32| Sensor { position: [0.001 * f64::from(i), 0.0, 0.0], normal: [0.0, 1.0, 0.0] };
    let points: Vec<_> = (0..600).map(|i| sensor(i).point(renderer.scene())).collect();
    let interrupt = AtomicBool::new(false);
    let mut first = None;
    let mut progress = |progress: &BakeProgress| {
        first.get_or_insert(progress.samples);
        // As long again as so far, of twice the samples.
        assert!(progress.seconds_left.is_some_and(|left| left == progress.seconds));
        interrupt.store(true, Ordering::Relaxed);
    };
    let stop = Stop { spp: Some(8), ..Stop::default() };
    let settings = BakeSettings { back_faces: true, stop, ..BakeSettings::default() };
    let baked = renderer.irradiance_with(&points, &settings, &mut progress, &interrupt).unwrap();
    // Fractions of back faces are counted after the first samples.
    assert!(baked.is_interrupted && first == Some(4), "{first:?}");
    assert!(baked.values.iter().all(|value| value.samples == 4 && value.value() > 0.0));
}

/// A square of side 2 at height 0, seen from a point light at height 2 above its middle.
fn square() -> SceneParts {
    let mut parts = SceneParts::default();
    let white = parts.material("white", Material::diffuse(Rgb::splat(0.5)));
    let positions = [[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]];
    let mesh = PartMesh { positions: &positions, triangles: &[[0, 1, 2], [0, 2, 3]], ..PartMesh::default() };
    parts.mesh("square", &mesh, white).unwrap();
    parts.light(PointLight::Point { position: [0.0, 2.0, 0.0].into(), intensity: Rgb::splat(8.0) });
    parts.view(View { eye: [0.0, 5.0, 0.0], look_at: [0.0; 3], up: [0.0, 0.0, -1.0] }, 1.0);
    parts
}

#[test]
fn a_scene_from_arrays_has_the_radiance_of_a_lambertian_square() {
    let renderer = Renderer::new(square().build().unwrap(), None).unwrap();
    let image = renderer.render(&settings(Method::Path, 4)).unwrap().image;
    // L = ρ / π · I / d² in the middle, and 0.3 % less where the picture ends.
    let right = 0.5 / core::f32::consts::PI * 8.0 / 4.0;
    assert!(image.pixels.iter().flatten().all(|value| (value / right - 1.0).abs() < 0.003), "{right}");
}

#[test]
fn arrays_that_do_not_fit_name_the_mesh_and_the_triangle() {
    let mut parts = square();
    let white = parts.material("white", Material::diffuse(Rgb::splat(0.5)));
    let positions = [[0.0; 3]; 3];
    let mesh = PartMesh { positions: &positions, triangles: &[[0, 1, 2], [0, 1, 3]], ..PartMesh::default() };
    let error = parts.mesh("roof", &mesh, white).unwrap_err();
    assert_eq!(
        error.to_string().lines().next(),
        Some("roof: triangle 1 refers to a vertex that does not exist")
    );
    let mesh = PartMesh { normals: &positions[..2], triangles: &[], ..mesh };
    let error = parts.mesh("roof", &mesh, white).unwrap_err();
    assert!(error.to_string().contains("2 normals and 3 positions"), "{error}");
}

#[test]
fn an_error_names_file_line_and_help_and_becomes_other_errors() {
    let folder = std::env::temp_dir().join(format!("halflight-error-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("broken.obj");
    std::fs::write(&file, "v 0 0 0\nv 1 0 zero\n").unwrap();
    let error = Renderer::open(&file).err().unwrap();
    assert_eq!((error.file(), error.line()), (Some(&*file), Some(2)));
    assert!(!error.help().is_empty());
    let text =
        format!("{}:2: `zero` in a `v` statement is not a number\n  help: {}", file.display(), error.help());
    assert_eq!(error.to_string(), text);
    let boxed = || -> Result<(), Box<dyn core::error::Error + Send + Sync>> { Err(error)? };
    assert_eq!(boxed().unwrap_err().to_string(), text);
    std::fs::remove_dir_all(folder).unwrap();

    let renderer = Renderer::new(square().build().unwrap(), None).unwrap();
    let error = renderer.render(&Settings { memory: Some(1), ..settings(Method::Path, 1) }).unwrap_err();
    assert!(error.to_string().ends_with(&format!("  help: {}", error.help())), "{error}");
    assert_eq!((error.file(), error.line()), (None, None));
}
