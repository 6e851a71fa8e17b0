//! First surfaces of small scenes with known clusters.

use super::{FirstSurfaces, NO_CLUSTER, PixelSurfaces, SurfaceComponents};
use crate::bsdf::All;
use crate::bvh::{Bvh, Serial};
use crate::light::LightSampler;
use crate::memory::{Arena, Line, OutOfMemory};
use crate::method::{Executor, Passed, PilotSize, RenderContext, Worker};
use crate::scene::{Camera, Environment, Material, Mesh, Scene, Surface, Triangle};
use crate::transport::{Counters, PathSettings, UNLIMITED};
use crate::{Level, Rgb};
use glam::Vec3;
use std::collections::BTreeSet;
use std::sync::Mutex;
use std::vec;
use std::vec::Vec;

/// Pixels along a side of the pictures.
const SIDE: u32 = 40;

/// Threads of a test, which take the tasks in turn.
pub(super) struct Threads(pub(super) usize);

impl Executor for Threads {
    type Fork = Serial;

    fn pass<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    {
        let queue = Mutex::new(pieces.enumerate());
        let total = Mutex::new(Ok(Counters::default()));
        let work = || {
            let mut memory = lines(FirstSurfaces::<All>::scratch().bytes());
            let mut worker = Worker::new(Arena::over(&mut memory), &|| false);
            loop {
                let next = queue.lock().unwrap().next();
                let Some((number, piece)) = next else { return };
                let done = task(number, piece, &mut worker);
                let mut total = total.lock().unwrap();
                *total = total.and_then(|mut sum| {
                    done.map(|done| {
                        sum += done;
                        sum
                    })
                });
            }
        };
        std::thread::scope(|scope| (0..self.0).for_each(|_| drop(scope.spawn(work))));
        total.into_inner().unwrap().map(|counters| Passed { counters, is_complete: true })
    }

    fn is_over(&self) -> bool {
        false
    }

    fn fork(&self) -> &Serial {
        &Serial
    }
}

fn lines(bytes: usize) -> Vec<Line> {
    vec![Line::ZERO; bytes.div_ceil(64)]
}

/// Quads with a material each, in one mesh.
#[derive(Default)]
struct Quads {
    positions: Vec<[f32; 3]>,
    triangles: Vec<Triangle>,
}

impl Quads {
    fn with(mut self, material: u32, corners: [[f32; 3]; 4]) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        for vertices in [[0, 1, 2], [0, 2, 3]] {
            self.triangles.push(Triangle { vertices: vertices.map(|i| first + i), material });
        }
        self
    }

    /// Quad that faces the camera at depth `z`, from one corner to the opposite one.
    fn facing(self, material: u32, z: f32, [left, bottom]: [f32; 2], [right, top]: [f32; 2]) -> Self {
        let corners = [[left, bottom, z], [right, bottom, z], [right, top, z], [left, top, z]];
        self.with(material, corners)
    }

    fn mesh(&self) -> Mesh<'_> {
        Mesh { positions: &self.positions, triangles: &self.triangles, ..Mesh::default() }
    }

    /// The five walls of a box around the line of sight, and a wall behind the camera of material 1.
    fn room() -> Self {
        let corner = |x: f32, y: f32, z: f32| [x, y, z];
        Self::default()
            .facing(0, -4.0, [-1.0, -1.0], [1.0, 1.0])
            .with(
                0,
                [
                    corner(-1.0, -1.0, 4.0),
                    corner(-1.0, -1.0, -4.0),
                    corner(-1.0, 1.0, -4.0),
                    corner(-1.0, 1.0, 4.0),
                ],
            )
            .with(
                0,
                [
                    corner(1.0, -1.0, 4.0),
                    corner(1.0, -1.0, -4.0),
                    corner(1.0, 1.0, -4.0),
                    corner(1.0, 1.0, 4.0),
                ],
            )
            .with(
                0,
                [
                    corner(-1.0, -1.0, 4.0),
                    corner(1.0, -1.0, 4.0),
                    corner(1.0, -1.0, -4.0),
                    corner(-1.0, -1.0, -4.0),
                ],
            )
            .with(
                0,
                [
                    corner(-1.0, 1.0, 4.0),
                    corner(1.0, 1.0, 4.0),
                    corner(1.0, 1.0, -4.0),
                    corner(-1.0, 1.0, -4.0),
                ],
            )
            .facing(1, 4.0, [-1.0, -1.0], [1.0, 1.0])
    }
}

const WHITE: Material = Material::diffuse(Rgb::splat(0.7));
const RED: Material = Material::diffuse(Rgb::new(0.6, 0.1, 0.1));

fn of(surface: Surface) -> Material {
    Material { surface, ..WHITE }
}

fn mirror() -> Material {
    of(Surface::Mirror { reflectance: Rgb::ONE.into() })
}

/// Camera at the origin along −z, whose pictures show ±1 at the distance 2.
fn camera() -> Camera {
    Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 2.0 * libm::atanf(0.5).to_degrees())
}

/// Calls `work` with a search for the surfaces of `scene`.
fn with_search<T>(scene: &Scene, work: impl FnOnce(&FirstSurfaces<All>) -> T) -> T {
    let mut bvh = lines(Bvh::footprint(scene.mesh.triangles.len()).bytes());
    let bvh = Bvh::build(&scene.mesh, &mut Arena::over(&mut bvh)).unwrap();
    let mut lights = lines(LightSampler::footprint(scene).and(LightSampler::scratch(scene)).bytes());
    let lights = LightSampler::build(scene, &mut Arena::over(&mut lights)).unwrap();
    let settings = PathSettings { width: SIDE, height: SIDE, seed: 1, max_depth: UNLIMITED };
    let (level, pilots) = (Level::detect(), PilotSize::USUAL);
    let context = RenderContext { scene, bvh, lights, settings, level, pilots };
    let mut memory = lines(SurfaceComponents::footprint(&scene.mesh).bytes());
    let components = SurfaceComponents::build(&scene.mesh, &mut Arena::over(&mut memory)).unwrap();
    work(&FirstSurfaces::new(&context, components))
}

/// Surfaces by a number of threads, in exactly the memory that is needed.
fn found(scene: &Scene, threads: usize) -> Vec<PixelSurfaces> {
    with_search(scene, |search| {
        let mut memory = lines(FirstSurfaces::<All>::footprint(SIDE, SIDE).bytes());
        search.find(&mut Arena::over(&mut memory), &mut Threads(threads)).unwrap().unwrap().to_vec()
    })
}

fn surfaces(quads: &Quads, materials: &[Material]) -> Vec<PixelSurfaces> {
    found(&Scene { mesh: quads.mesh(), materials, camera: camera(), ..Scene::default() }, 1)
}

/// Pixel at a point of the plane at distance 2, −1 to 1 in both coordinates.
fn at(pixels: &[PixelSurfaces], x: f32, y: f32) -> PixelSurfaces {
    let [column, row] = [1.0 + x, 1.0 - y].map(|at| (0.5 * at * SIDE as f32) as usize);
    pixels[row * SIDE as usize + column]
}

fn is_whole(pixel: &PixelSurfaces) -> bool {
    pixel.fractions == [1.0, 0.0, 0.0, 0.0] && pixel.clusters[1..] == [NO_CLUSTER; 3]
}

#[test]
fn the_walls_of_a_box_are_its_clusters() {
    let pixels = surfaces(&Quads::room(), &[WHITE, RED]);
    let walls =
        [(0.0, 0.0), (-0.9, 0.0), (0.9, 0.0), (0.0, -0.9), (0.0, 0.9)].map(|(x, y)| at(&pixels, x, y));
    assert!(walls.iter().all(is_whole));
    let numbers: BTreeSet<_> = walls.iter().map(|wall| wall.clusters[0]).collect();
    let all: BTreeSet<_> = pixels.iter().flat_map(|p| p.clusters).filter(|&c| c != NO_CLUSTER).collect();
    assert_eq!((numbers.len(), &numbers), (5, &all));
    assert!((walls[0].depth - 4.0).abs() < 0.01, "{}", walls[0].depth);
    let normals = walls.map(|wall| Vec3::from(wall.normal));
    let expected = [Vec3::Z, Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y];
    assert!(normals.iter().zip(expected).all(|(a, b)| a.distance(b) < 1e-5), "{normals:?}");
    assert!(walls.iter().all(|wall| Vec3::from(wall.albedo).distance(Vec3::splat(0.7)) < 1e-5));
}

#[test]
fn a_mirror_shows_clusters_of_its_own() {
    // Half of the view is a mirror, which shows the walls and the red wall behind the camera.
    let quads = Quads::room().facing(2, -2.0, [-1.0, -1.0], [0.0, 1.0]);
    let pixels = surfaces(&quads, &[WHITE, RED, mirror()]);
    let (mirrored, behind) = (at(&pixels, -0.1, 0.05), at(&pixels, 0.1, 0.05));
    assert!(is_whole(&mirrored) && is_whole(&behind));
    assert_ne!(mirrored.clusters[0], behind.clusters[0]);
    assert!(Vec3::from(mirrored.albedo).distance(Vec3::new(0.6, 0.1, 0.1)) < 1e-6);
    assert!((mirrored.depth - 2.0).abs() < 0.02 && (behind.depth - 4.0).abs() < 0.02);
    let wall = at(&pixels, -0.9, 0.05);
    assert!(is_whole(&wall) && wall.clusters[0] != mirrored.clusters[0], "the wall in the mirror");
}

#[test]
fn glass_shows_what_is_behind_it_and_what_it_reflects() {
    // The lamp behind the camera is reflected by the lower half of the pane.
    let glass = of(Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: 0.0.into() });
    let quads = Quads::room()
        .facing(2, -1.0, [-0.5, -0.5], [0.5, 0.5])
        .facing(2, -1.01, [-0.5, -0.5], [0.5, 0.5])
        .facing(3, 2.0, [-1.0, -1.0], [1.0, -0.2]);
    let pixels = surfaces(&quads, &[WHITE, RED, glass, Material::lamp(Rgb::splat(9.0))]);
    let [above, below] = [0.1, -0.3].map(|y| at(&pixels, 0.1, y));
    assert!(is_whole(&above) && is_whole(&below));
    assert_ne!(above.clusters[0], below.clusters[0]);
    assert!([above, below].iter().all(|p| Vec3::from(p.albedo).distance(Vec3::splat(0.7)) < 1e-5));
    assert!([above, below].iter().all(|p| (p.depth - 1.0).abs() < 0.03));
}

#[test]
fn weak_coats_show_mirrored_lamps_alone() {
    let coat = |specular: f32| {
        of(Surface::Glossy {
            base: Rgb::splat(0.5).into(),
            specular: Rgb::splat(specular).into(),
            roughness: 0.0.into(),
            metallic: 0.0.into(),
            ior: None,
        })
    };
    let quads = Quads::room()
        .facing(2, -2.0, [-0.9, -0.9], [0.9, 0.9])
        .facing(3, 2.0, [-1.0, -1.0], [1.0, -0.4])
        .facing(1, 2.0, [-1.0, -0.4], [1.0, 0.1]);
    for (specular, clusters) in [(0.04, 2), (0.5, 3)] {
        let materials = [WHITE, RED, coat(specular), Material::lamp(Rgb::splat(9.0))];
        let pixels = surfaces(&quads, &materials);
        // The wall behind the camera, a red board, a lamp.
        let seen = [0.2, -0.02, -0.22].map(|y| at(&pixels, 0.05, y));
        assert!(seen.iter().all(is_whole));
        let numbers: BTreeSet<_> = seen.iter().map(|pixel| pixel.clusters[0]).collect();
        assert_eq!(numbers.len(), clusters, "{specular}: {seen:?}");
    }
}

#[test]
fn fractions_of_an_edge_are_those_of_the_pixel() {
    // An edge through (-1, -0.3) and (1, 0.5) at the distance 2.
    let (from, to) = (-0.3f32, 0.5f32);
    let quads = Quads::default()
        .with(0, [[-1.0, -2.0, -2.0], [1.0, -2.0, -2.0], [1.0, to, -2.0], [-1.0, from, -2.0]])
        .with(1, [[-1.0, from, -2.0], [1.0, to, -2.0], [1.0, 2.0, -2.0], [-1.0, 2.0, -2.0]]);
    let pixels = surfaces(&quads, &[WHITE, RED]);
    let (mut errors, mut mixed) = (0.0, 0);
    let below = at(&pixels, 0.0, -0.9).clusters[0];
    for (i, pixel) in pixels.iter().enumerate() {
        let [column, row] = [i as u32 % SIDE, i as u32 / SIDE].map(|at| at as f64);
        // Area below the edge by the midpoint rule in columns.
        let pixel_side = 2.0 / f64::from(SIDE);
        let strips = 1000;
        let area: f64 = (0..strips)
            .map(|strip| {
                let x = -1.0 + (column + (f64::from(strip) + 0.5) / f64::from(strips)) * pixel_side;
                let height = f64::from(from) + (x + 1.0) / 2.0 * f64::from(to - from);
                ((height - (1.0 - (row + 1.0) * pixel_side)) / pixel_side).clamp(0.0, 1.0)
            })
            .sum::<f64>()
            / f64::from(strips);
        let found = pixel.clusters.iter().zip(pixel.fractions).find(|(c, _)| **c == below);
        let error = f64::from(found.map_or(0.0, |(_, f)| f)) - area;
        // A line crosses about 32 of the 256 squares of a net of 16 x 16, half of a ray on either side.
        assert!(error.abs() < 0.05, "pixel {column}, {row}: {pixel:?}, area {area}");
        assert!((pixel.fractions.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        if area > 0.0 && area < 1.0 {
            (errors, mixed) = (errors + error * error, mixed + 1);
        }
    }
    let deviation = (errors / f64::from(mixed)).sqrt();
    assert!(mixed > 40 && deviation < 0.01, "{deviation} in {mixed} pixels");
}

#[test]
fn pixels_beside_a_lamp_are_not_whole() {
    let quads = Quads::room().facing(2, -3.0, [-0.4, -0.4], [0.37, 0.4]);
    let pixels = surfaces(&quads, &[WHITE, RED, Material::lamp(Rgb::splat(9.0))]);
    let rows = SIDE as usize;
    let lamp = at(&pixels, 0.0, 0.0);
    assert!(is_whole(&lamp) && lamp.albedo == [1.0; 3]);
    let is_mixed =
        |i: usize| pixels[i].clusters[1] != NO_CLUSTER && pixels[i].clusters.contains(&lamp.clusters[0]);
    let mut beside = 0;
    for i in 0..pixels.len() {
        let (x, y) = (i % rows, i / rows);
        let near = |other: usize| (other % rows).abs_diff(x) <= 1 && (other / rows).abs_diff(y) <= 1;
        let has_rim = (0..pixels.len()).any(|other| near(other) && is_mixed(other));
        if has_rim && !is_mixed(i) {
            beside += 1;
            assert!(pixels[i].fractions[0] < 1.0, "{x}, {y}");
        }
    }
    assert!(beside > 30, "{beside}");
}

#[test]
fn rays_pass_cutouts_and_a_surface_that_the_camera_lies_on() {
    let absent = Material { opacity: 0.0.into(), ..RED };
    // The back of a wall at the camera, and a sheet that is not there.
    let quads = Quads::room()
        .with(1, [[-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]])
        .facing(2, -2.0, [-1.0, -1.0], [1.0, 1.0]);
    let plain = surfaces(&Quads::room(), &[WHITE, RED]);
    let pixels = surfaces(&quads, &[WHITE, RED, absent]);
    let [a, b] = [&pixels, &plain].map(|pixels| at(pixels, 0.03, 0.03));
    assert_eq!((a.clusters, a.fractions), (b.clusters, b.fractions));
    assert!((a.depth - b.depth).abs() < 1e-3 && (a.depth - 4.0).abs() < 0.01, "{}", a.depth);
}

#[test]
fn a_lens_mixes_what_is_out_of_focus() {
    let quads =
        Quads::default().facing(0, -2.0, [-1.0, -3.0], [0.0, 3.0]).facing(1, -4.0, [-9.0, -9.0], [9.0, 9.0]);
    let scene = Scene { mesh: quads.mesh(), materials: &[WHITE, RED], camera: camera(), ..Scene::default() };
    let lens = Camera { lens_radius: 0.2, focus_distance: 4.0, ..camera() };
    let mixed = |scene: &Scene| found(scene, 1).iter().filter(|pixel| !is_whole(pixel)).count();
    // The circle of confusion is 0.2 wide at the distance 2: four pixels of 40.
    let (sharp, blurred) = (mixed(&scene), mixed(&Scene { camera: lens, ..scene }));
    assert!(sharp <= SIDE as usize && blurred >= 3 * SIDE as usize, "{sharp} {blurred}");
}

#[test]
fn the_environment_is_a_cluster_without_depth() {
    let quads = Quads::default().facing(0, -2.0, [-1.0, -1.0], [0.0, 1.0]);
    let environment = Some(Environment::uniform(Rgb::ONE));
    let scene =
        Scene { mesh: quads.mesh(), materials: &[WHITE], camera: camera(), environment, ..Scene::default() };
    let sky = at(&found(&scene, 1), 0.5, 0.0);
    assert!(is_whole(&sky) && sky.depth == 0.0 && sky.albedo == [1.0; 3] && sky.normal == [0.0; 3]);
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let glass = of(Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: 0.0.into() });
    let quads =
        Quads::room().facing(2, -2.0, [-0.8, -0.5], [0.1, 0.4]).facing(3, -3.0, [0.2, 0.3], [0.5, 0.4]);
    let materials = [WHITE, RED, glass, mirror()];
    let scene = Scene { mesh: quads.mesh(), materials: &materials, camera: camera(), ..Scene::default() };
    assert!(found(&scene, 1) == found(&scene, 7));
}

#[test]
fn footprints_are_exact() {
    let quads = Quads::room();
    let scene = Scene { mesh: quads.mesh(), materials: &[WHITE, RED], camera: camera(), ..Scene::default() };
    with_search(&scene, |search| {
        let bytes = FirstSurfaces::<All>::footprint(SIDE, SIDE).bytes();
        let mut memory = lines(bytes);
        let memory: &mut [u8] = bytemuck::cast_slice_mut(&mut memory);
        let mut arena = Arena::new(memory);
        assert!(search.find(&mut arena, &mut Threads(1)).is_ok());
        let kept = FirstSurfaces::<All>::kept_footprint(SIDE, SIDE).bytes();
        assert_eq!(arena.available(), bytes - kept);
        assert!(search.find(&mut Arena::new(&mut memory[..bytes - 1]), &mut Threads(1)).is_err());
    });
    let bytes = SurfaceComponents::footprint(&scene.mesh).bytes();
    let mut memory = lines(bytes);
    let memory: &mut [u8] = bytemuck::cast_slice_mut(&mut memory);
    assert!(SurfaceComponents::build(&scene.mesh, &mut Arena::new(memory)).is_ok());
    assert!(SurfaceComponents::build(&scene.mesh, &mut Arena::new(&mut memory[..bytes - 1])).is_err());
}
