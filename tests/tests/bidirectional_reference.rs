//! Bidirectional path tracing as a whole: the wavefront with its running MIS sums against the textbook, which
//! computes the densities of all techniques.

use glam::Vec3;
use halflight_core::bsdf::All;
use halflight_core::film::{PIXELS_PER_TILE, Pixel, Splat, Tile};
use halflight_core::light::EmissionSampler;
use halflight_core::photon::Photons;
use halflight_core::scene::{Camera, PointLight, Scene};
use halflight_core::transport::bidirectional::Counts;
use halflight_core::transport::bidirectional::camera_paths::{CameraPaths, Connections};
use halflight_core::transport::bidirectional::light_pass::{LightPass, TaskOutput, VERTICES_PER_TASK};
use halflight_core::transport::bidirectional::merge_photons::{MergeRadii, Merging};
use halflight_core::transport::bidirectional::reference::{LightPath, Reference};
use halflight_core::transport::bidirectional::vertex::LightVertex;
use halflight_core::transport::{PathSettings, RadiusSchedule, SceneContext};
use halflight_core::{Level, Rgb};
use halflight_tests::memory::{TestArena, with_structures};
use halflight_tests::scenes::{
    SceneBuffers, cornell_box, everything, glass, in_a_room, lamp_before, lamp_over_ball, metal,
    room_with_lamp, varnished,
};

/// Pixels across and down; then light paths per sample.
const SIZE: u32 = 16;
const LIGHT_PATHS: usize = 512;

/// Relative tolerance of rounding.
const ROUNDING: f32 = 1e-4;

/// Statistics of a comparison.
#[derive(Clone, Copy, Debug, Default)]
struct Compared {
    /// Number of pixels and splats.
    values: usize,
    /// Values that differ by more than [`ROUNDING`].
    wrong: usize,
    worst: f32,
}

impl Compared {
    fn add(&mut self, found: Rgb, expected: Rgb) {
        self.values += 1;
        assert!(found.is_finite() && expected.is_finite());
        let error = (found - expected).abs().max_element() / expected.max_element().max(1e-6);
        self.worst = self.worst.max(error);
        self.wrong += usize::from(error > ROUNDING);
    }
}

/// Samples per pixel.
const SAMPLES: u32 = 2;

/// Change of the textbook's sample counts and merge radii, which otherwise equal those of the wavefront.
type Change = fn(&mut Counts, &mut Option<MergeRadii>);

/// Compares the wavefront with the textbook after `change`. Each vertex has `connections` connections, and
/// MIS weights include merges within `merge_radius` pixels.
fn compare(scene: &Scene, connections: u32, merge_radius: Option<f64>, change: Change) -> Compared {
    with_structures(scene, |bvh, lights| {
        let settings = PathSettings { width: SIZE, height: SIZE, seed: 7, max_depth: 10 };
        let context = SceneContext::<All>::new(scene, bvh, lights, Level::detect());
        let mut memory = TestArena::new(EmissionSampler::footprint(lights.count()));
        let emission = EmissionSampler::build(scene, lights, &bvh.bounds(), &mut memory.arena()).unwrap();
        let light_paths = LIGHT_PATHS as f32;
        let counts = Counts { light_paths, connections: 0.4 * connections as f32, light_samples: 1.0 };
        let radii = merge_radius.map(|pixels| {
            let radii = RadiusSchedule::new((scene, bvh), [SIZE; 2], Level::detect());
            MergeRadii { radii: radii.after(pixels, 0), light_paths, emphasis: 1.0 }
        });
        let (mut of_reference, mut radii_of_reference) = (counts, radii);
        change(&mut of_reference, &mut radii_of_reference);
        let reference = Reference::new(context, &emission, settings, of_reference, radii_of_reference);
        let pass = LightPass::new(context, &emission, settings, counts, radii);

        let mut memory = TestArena::new(Photons::footprint(1));
        let photons = Photons::new(1, &mut memory.arena()).unwrap();
        let photons = photons.build(0);
        let scratch = LightPass::<All>::scratch().or(CameraPaths::<All>::scratch(connections));
        let mut scratch = TestArena::new(scratch);
        let mut vertices = vec![LightVertex::default(); VERTICES_PER_TASK];
        let (mut splats, mut output) = (vec![Splat::default(); VERTICES_PER_TASK], TaskOutput::default());
        let mut paths = vec![LightPath::default(); LIGHT_PATHS];
        let mut stored = vec![(0, 0); VERTICES_PER_TASK];
        let mut compared = Compared::default();
        for sample in 0..SAMPLES {
            splats.fill(Splat::default());
            pass.run((0, sample), &mut scratch.arena(), &mut vertices, &mut splats, &mut output).unwrap();
            let count = reference.light_paths(sample, &mut scratch.arena(), &mut paths, &mut stored).unwrap();
            if connections > 0 {
                assert_eq!(output.vertices as usize, count);
            }
            let mut expected = vec![];
            for path in &paths {
                for end in 1..=path.len() {
                    expected.extend(reference.splat(path, end).map(|([x, y], radiance)| {
                        (Tile::position([SIZE; 2], x, y) as u32, radiance.to_array())
                    }));
                }
            }
            let mut found: Vec<_> = splats.iter().map(|splat| (splat.pixel, splat.radiance)).collect();
            assert!(found[expected.len()..].iter().all(|(_, radiance)| *radiance == [0.0; 3]));
            found.truncate(expected.len());
            let sum = |radiance: &[f32; 3]| radiance.iter().sum::<f32>();
            found.sort_by(|a, b| (a.0, sum(&a.1)).partial_cmp(&(b.0, sum(&b.1))).unwrap());
            expected.sort_by(|a, b| (a.0, sum(&a.1)).partial_cmp(&(b.0, sum(&b.1))).unwrap());
            for (a, b) in found.iter().zip(&expected) {
                compared.add(a.1.into(), b.1.into());
            }

            let vertices = &vertices[..count * usize::from(connections > 0)];
            let stored = &stored[..vertices.len()];
            let merging = radii.map(|radii| Merging { photons, vertices, radii });
            let camera_paths = CameraPaths::new(
                context,
                &emission,
                settings,
                counts,
                Connections { vertices, count: connections },
            )
            .with_merging(merging);
            let mut pixels = vec![Pixel::default(); PIXELS_PER_TILE];
            camera_paths.run(0, sample..sample + 1, &[], &mut scratch.arena(), &mut pixels).unwrap();
            for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
                let Some(expected) = reference.radiance([x, y], sample, &paths, (stored, connections)) else {
                    continue;
                };
                let pixel = &pixels[Tile::position([SIZE; 2], x, y)];
                compared.add(pixel.even.sum() + pixel.odd.sum(), expected);
            }
        }
        compared
    })
}

/// Scenes with all kinds of lights and surfaces, a lens, cut-outs and vertex normals.
fn scenes() -> [(&'static str, SceneBuffers); 8] {
    let with = |mut buffers: SceneBuffers, light: PointLight| {
        buffers.lights.push(light);
        buffers
    };
    let (position, intensity) = (Vec3::new(0.5, 0.9, 0.4), Rgb::splat(0.3));
    let spot = PointLight::Spot {
        position,
        intensity,
        direction: Vec3::new(0.1, -1.0, 0.2).normalize(),
        cos_inner: 0.9,
        cos_outer: 0.8,
    };
    let direction = Vec3::new(0.2, -1.0, 0.3).normalize();
    let sun = PointLight::Directional { direction, irradiance: Rgb::splat(2.0) };
    [
        ("box", with(cornell_box(), spot)),
        ("everything", everything()),
        ("lamp with a cut-out", room_with_lamp(0.3, 5.0)),
        ("glass", in_a_room(lamp_over_ball(glass(0.0), 2.0))),
        ("rough glass", with(lamp_over_ball(glass(0.4), 2.0), sun)),
        ("mirror", in_a_room(lamp_before(metal(0.0), 0.6))),
        ("metal", with(in_a_room(lamp_before(metal(0.3), 0.6)), PointLight::Point { position, intensity })),
        ("varnish", varnished(cornell_box(), 0.1)),
    ]
}

#[test]
fn running_sums_weigh_paths_as_all_densities_do() {
    for (name, buffers) in scenes() {
        for (connections, radius) in [(0, None), (2, None), (2, Some(3.0))] {
            let compared = compare(&buffers.scene(), connections, radius, |_, _| ());
            // All pixels of two samples, and splats. Short segments and narrow lobes magnify rounding.
            let Compared { values, wrong, worst } = compared;
            assert!(values > 512 && wrong <= values / 100 && worst < 1e-3, "{name} {radius:?} {compared:?}");
        }
    }
}

#[test]
fn splats_and_weights_of_other_cameras_are_those_of_the_textbook() {
    let mut buffers = cornell_box();
    let inside = Camera::look_at(Vec3::new(0.5, 0.75, 0.35), Vec3::new(0.5, 0.2, 0.6), Vec3::Y, 40.0);
    let parallel = inside.orthographic(0.5);
    let lens = Camera { lens_radius: 0.03, focus_distance: 0.4, ..parallel };
    for camera in [parallel, lens, inside.panorama()] {
        buffers.camera = camera;
        for radius in [None, Some(2.0)] {
            let compared = compare(&buffers.scene(), 1, radius, |_, _| ());
            let few = compared.values / 1000;
            assert!(compared.values > 500 && compared.wrong <= few, "{:?}: {compared:?}", camera.kind);
        }
    }
}

#[test]
fn other_counts_and_forgotten_merges_are_noticed() {
    let noticed = |buffers: &SceneBuffers, change: Change| {
        let Compared { values, wrong, .. } = compare(&buffers.scene(), 2, Some(3.0), change);
        wrong as f32 / values as f32
    };
    for (name, buffers) in scenes() {
        let share = noticed(&buffers, |counts, _| counts.connections *= 1.1);
        assert!(share > 0.05, "{name} {share}");
        let share = noticed(&buffers, |counts, _| counts.light_samples = 1.1);
        assert!(share > 0.05, "{name} {share}");
    }
    let glass = in_a_room(lamp_over_ball(glass(0.0), 2.0));
    let share = noticed(&glass, |_, radii| *radii = None);
    assert!(share > 0.05, "{share}");
}
