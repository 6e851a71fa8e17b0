//! Light vertices, splats and photons of bidirectional path tracing in any room: as many vertices as the
//! textbook stores, no NaN in pixels and splats, and equal sums of light.

use crate::rooms::{arena, level, lines, with_room};
use arbitrary::{Result, Unstructured};
use halflight_core::bsdf::All;
use halflight_core::film::{PIXELS_PER_TILE, Pixel, Splat, Tile};
use halflight_core::light::EmissionSampler;
use halflight_core::photon::Photons;
use halflight_core::transport::bidirectional::Counts;
use halflight_core::transport::bidirectional::camera_paths::{CameraPaths, Connections};
use halflight_core::transport::bidirectional::light_pass::{LightPass, TaskOutput, VERTICES_PER_TASK};
use halflight_core::transport::bidirectional::merge_photons::{MergeRadii, Merging};
use halflight_core::transport::bidirectional::reference::{LightPath, Reference};
use halflight_core::transport::bidirectional::vertex::LightVertex;
use halflight_core::transport::{RadiusSchedule, SceneContext};
use halflight_core::{Level, Rgb};

/// Most light paths of a sample.
const PATHS: usize = 64;

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    with_room(input, |input, scene, bvh, lights, settings| {
        let [count, connections, merges] = input.arbitrary::<[u8; 3]>()?;
        let (sample, light_paths) = (input.arbitrary::<u32>()? % (1 << 30), 1 + usize::from(count) % PATHS);
        let connections = u32::from(connections % 4);
        let context = SceneContext::<All>::new(scene, bvh, lights, level(input)?);
        let mut memory = lines(EmissionSampler::footprint(lights.count()));
        let emission = EmissionSampler::build(scene, lights, &bvh.bounds(), &mut arena(&mut memory));
        let emission = emission.expect("the footprint was granted");
        let counts = Counts {
            light_paths: light_paths as f32,
            connections: 0.5 * connections as f32,
            light_samples: 1.0,
        };
        let size = [settings.width, settings.height];
        let radii = RadiusSchedule::new((scene, bvh), size, Level::BASELINE).after(3.0, sample % 1024);
        let radii =
            (merges % 2 > 0).then_some(MergeRadii { radii, light_paths: counts.light_paths, emphasis: 1.0 });

        let mut vertices = vec![LightVertex::default(); VERTICES_PER_TASK];
        let (mut splats, mut output) = (vec![Splat::default(); VERTICES_PER_TASK], TaskOutput::default());
        let footprint = LightPass::<All>::scratch().or(CameraPaths::<All>::scratch(connections));
        let mut scratch = lines(footprint);
        let pass = LightPass::new(context, &emission, settings, counts, radii);
        let room = (&mut vertices[..], &mut splats[..]);
        pass.run((0, sample), &mut arena(&mut scratch), room.0, room.1, &mut output)
            .expect("the footprint was granted");

        let reference = Reference::new(context, &emission, settings, counts, radii);
        let mut paths = vec![LightPath::default(); light_paths];
        let mut stored = vec![(0, 0); VERTICES_PER_TASK];
        let count = reference.light_paths(sample, &mut arena(&mut scratch), &mut paths, &mut stored);
        let count = count.expect("the footprint was granted");
        let is_stored = connections > 0 || radii.is_some();
        assert_eq!(output.vertices as usize, if is_stored { count } else { 0 });
        let vertices = &vertices[..output.vertices as usize];

        let mut film = vec![[0.0f32; 3]; Tile::count(settings.width, settings.height) * PIXELS_PER_TILE];
        for splat in &splats {
            let radiance = Rgb::from(splat.radiance);
            assert!(radiance.min_element() >= 0.0 && radiance.is_finite(), "{splat:?}");
            film[splat.pixel as usize][1] += radiance.y;
        }
        let mut expected = film.clone();
        expected.fill([0.0; 3]);
        for (path, end) in paths.iter().flat_map(|path| (1..=path.len()).map(move |end| (path, end))) {
            if let Some(([x, y], radiance)) = reference.splat(path, end) {
                expected[Tile::position(size, x, y)][1] += radiance.y;
            }
        }
        let total = |film: &[[f32; 3]]| film.iter().map(|light| f64::from(light[1])).sum::<f64>();
        same(total(&film), total(&expected));

        // Photons for merging.
        let mut memory = lines(Photons::footprint(vertices.len().max(1)));
        let mut photons =
            Photons::new(vertices.len().max(1), &mut arena(&mut memory)).expect("it was granted");
        for (i, vertex) in vertices.iter().enumerate().filter(|_| radii.is_some()) {
            photons.as_mut_slice()[i] = vertex.photon(&context, i as u32);
        }
        let photons = photons.build(if radii.is_some() { vertices.len() } else { 0 });
        let merging = radii.map(|radii| Merging { photons, vertices, radii });
        let shown = if connections > 0 { vertices } else { &[] };
        let connected = Connections { vertices: shown, count: connections };
        let camera_paths = CameraPaths::new(context, &emission, settings, counts, connected);
        let (mut light, mut known) = (0.0, Some(0.0));
        for tile in 0..Tile::count(settings.width, settings.height) {
            let mut film = vec![Pixel::default(); PIXELS_PER_TILE];
            camera_paths
                .with_merging(merging)
                .run(tile, sample..sample + 1, &[], &mut arena(&mut scratch), &mut film)
                .expect("the footprint was granted");
            for pixel in &film {
                let sum = pixel.even.sum() + pixel.odd.sum();
                assert!(sum.min_element() >= 0.0 && sum.is_finite(), "{sum}");
                light += f64::from(sum.y);
            }
        }
        for (x, y) in (0..settings.height).flat_map(|y| (0..settings.width).map(move |x| (x, y))) {
            let stored = &stored[..shown.len()];
            let radiance = reference.radiance([x, y], sample, &paths, (stored, connections));
            known = known.zip(radiance).map(|(known, radiance)| known + f64::from(radiance.y));
        }
        // The textbook merges no photons, and leaves out paths whose normals depend on their direction.
        if let (Some(known), true) = (known, radii.is_none()) {
            same(light, known);
        }
        Ok(())
    })
}

/// Asserts equal sums of light, up to the rounding of directions over short segments.
fn same(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 2e-2 * expected.max(1e-20), "{found}, the textbook's {expected}");
}
