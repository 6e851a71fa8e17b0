//! Pixels that see an edge: they are found, and several paths for each of their samples leave less noise and the same mean.

use glam::{Vec2, Vec3};
use halflight_core::bsdf::All;
use halflight_core::bvh::Bvh;
use halflight_core::film::{Film, PIXELS_PER_TILE, Pixel, PixelSet, Tile};
use halflight_core::light::LightSampler;
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::scene::{Camera, Material, Scene};
use halflight_core::transport::{Counters, PathSettings, PathTracer};
use halflight_core::{Level, Rgb};
use halflight_tests::scenes::{SceneBuffers, cornell_box};

/// Pixels across and down: nine tiles, the outer ones cut by the border.
const SIZE: u32 = 40;

fn lines(footprint: Footprint) -> Vec<Line> {
    vec![Line([0; 64]); footprint.bytes() / 64]
}

/// Hands a path tracer of direct light to `then`, and the edges that it finds.
fn with_edges<T>(scene: &Scene, then: impl FnOnce(PathTracer<All>, &[PixelSet]) -> T) -> T {
    let settings = PathSettings { width: SIZE, height: SIZE, seed: 3, max_depth: 2, reuse: false };
    let mut bvh_lines = lines(Bvh::footprint(scene.mesh.triangles.len()));
    let bvh = Bvh::build(&scene.mesh, &mut Arena::new(bytemuck::cast_slice_mut(&mut bvh_lines))).unwrap();
    let mut light_lines = lines(LightSampler::footprint(scene).and(LightSampler::scratch(scene)));
    let lights =
        LightSampler::build(scene, &mut Arena::new(bytemuck::cast_slice_mut(&mut light_lines))).unwrap();
    let tracer = PathTracer::<All>::new(scene, &bvh, &lights, settings, Level::detect());
    let edges: Vec<_> =
        (0..tracer.tasks()).map(|task| tracer.edges(task, &mut Counters::default())).collect();
    then(tracer, &edges)
}

fn picture(tracer: &PathTracer<All>, wave: usize, cuts: &[u32]) -> Vec<Pixel> {
    let mut scratch = lines(PathTracer::<All>::scratch(wave));
    let mut scratch = Arena::new(bytemuck::cast_slice_mut(&mut scratch));
    let mut film_lines = lines(Film::footprint(SIZE, SIZE));
    let mut film = Film::new(SIZE, SIZE, &mut Arena::new(bytemuck::cast_slice_mut(&mut film_lines))).unwrap();
    for (task, pixels) in film.pixels_mut().chunks_mut(PIXELS_PER_TILE).enumerate() {
        for cut in cuts.windows(2) {
            tracer.run(task, cut[0]..cut[1], wave, &mut scratch, pixels).unwrap();
        }
    }
    film.pixels().to_vec()
}

fn is_edge(edges: &[PixelSet], index: usize) -> bool {
    edges[index / PIXELS_PER_TILE].contains(index % PIXELS_PER_TILE)
}

#[test]
fn edges_are_where_a_thing_ends() {
    let camera = Camera::look_at(Vec3::new(0.3, 0.2, 0.5), Vec3::new(0.1, -0.4, -3.0), Vec3::Y, 50.0);
    let through = |x: f32, y: f32, depth: f32| {
        let direction = Vec3::from(camera.ray(SIZE, SIZE, x, y, [0.5; 2]).direction);
        camera.eye + depth * direction / direction.dot(camera.forward)
    };
    let (low, high) = (Vec2::new(9.3, 8.6), Vec2::new(22.4, 30.7));
    let mut scene = SceneBuffers::new(camera);
    let grey = scene.material(Material::GREY);
    let quad = |low: Vec2, high: Vec2, depth: f32| {
        [(low.x, high.y), (high.x, high.y), (high.x, low.y), (low.x, low.y)]
            .map(|(x, y)| through(x, y, depth))
    };
    scene.quad(quad(low, high, 1.0), grey);
    scene.quad(quad(Vec2::splat(-5.0), Vec2::splat(SIZE as f32 + 5.0), 2.0), grey);
    let inside = |x: f32, y: f32| x > low.x && x < high.x && y > low.y && y < high.y;
    with_edges(&scene.scene(), |_, edges| {
        for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
            let (left, top) = (x as f32, y as f32);
            let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
            let inner = corners.iter().filter(|(dx, dy)| inside(left + dx, top + dy)).count();
            let found = is_edge(edges, Tile::position(SIZE, x, y));
            assert_eq!(found, inner % 4 != 0, "{x} {y}: {inner} corners");
        }
    });
    // A lens blurs them.
    scene.camera.lens_radius = 0.1;
    with_edges(&scene.scene(), |_, edges| assert!(edges.iter().all(PixelSet::is_empty)));
}

#[test]
fn edges_have_less_noise_and_all_else_the_same_bits() {
    let buffers = cornell_box();
    with_edges(&buffers.scene(), |tracer, edges| {
        let exact = picture(&tracer, 2048, &[0, 4096]);
        let without = picture(&tracer, 2048, &[0, 8]);
        let with_edges = tracer.with_edges(edges);
        let with = picture(&with_edges, 2048, &[0, 8]);
        let (mut light, mut before, mut after, mut count) = ([Rgb::ZERO; 2], 0.0, 0.0, 0);
        for (i, exact) in exact.iter().enumerate() {
            if !is_edge(edges, i) || with[i] == without[i] {
                assert!(with[i] == without[i], "{i}");
                continue;
            }
            assert_eq!((with[i].count(), with[i].even.count()), (8, 4));
            count += 1;
            light[0] += with[i].mean();
            light[1] += exact.mean();
            before += (without[i].mean() - exact.mean()).length_squared();
            after += (with[i].mean() - exact.mean()).length_squared();
        }
        assert!(count > 100 && count < 400, "{count}");
        // As many paths as 32 samples have, in two nets.
        assert!(after < 0.25 * before, "{after} {before}");
        assert!((light[0] / light[1] - Rgb::ONE).abs().max_element() < 0.02, "{light:?}");
        for (wave, cuts) in [(1, [0, 8].as_slice()), (100, &[0, 1, 8]), (5000, &[0, 3, 4, 8])] {
            assert!(picture(&with_edges, wave, cuts) == with, "waves of {wave}, rounds {cuts:?}");
        }
    });
}
