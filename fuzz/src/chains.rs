//! Markov chains of Metropolis light transport in any room, in both primary sample spaces: each mutation adds
//! luminance 1, starts follow cumulated densities, and no splat leaves the film.

use crate::rooms::{arena, level, lines, with_room};
use arbitrary::{Result, Unstructured};
use halflight_core::bsdf::All;
use halflight_core::film::{PIXELS_PER_TILE, Splat, Tile};
use halflight_core::light::{EmissionSampler, luminance};
use halflight_core::transport::SceneContext;
use halflight_core::transport::metropolis::bootstrap::{Bootstrap, CANDIDATES, Lengths};
use halflight_core::transport::metropolis::chain::{Chains, ChainsOutput, room};
use halflight_core::transport::metropolis::split::{MAX_SEGMENTS, PrimarySpace, Split};
use halflight_core::transport::metropolis::target::Target;

/// Most chains, and most mutations of each.
const CHAINS: usize = 40;
const MUTATIONS: usize = 12;

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    with_room(input, |input, scene, bvh, lights, settings| {
        if lights.is_empty() || settings.max_depth < 3 {
            return Ok(());
        }
        let [kind, chains, mutations, threshold] = input.arbitrary::<[u8; 4]>()?;
        let sample = input.arbitrary::<u32>()?;
        let context = SceneContext::<All>::new(scene, bvh, lights, level(input)?);
        let mut memory = lines(EmissionSampler::footprint(lights.count()));
        let emission = EmissionSampler::build(scene, lights, &bvh.bounds(), &mut arena(&mut memory));
        let emission = emission.expect("the footprint was granted");
        let pixels = Tile::count(settings.width, settings.height) * PIXELS_PER_TILE;
        let (space, max_segments) = match kind % 2 {
            0 => (PrimarySpace::Multiplexed, MAX_SEGMENTS.min(settings.max_depth)),
            _ => (PrimarySpace::PathTracing, u32::MAX),
        };
        let threshold = [0.0, 0.5, 2.0, f32::INFINITY][usize::from(threshold % 4)];
        // Without levels all pixels have equal weight.
        let split = Split { levels: &[], threshold, max_segments, space };
        let target = Target::<All>::new(context, &emission, settings, split);
        let weights = input.arbitrary::<[u8; 4]>()?;
        let lengths = Lengths::new(target.lengths(), |segments| f64::from(weights[segments as usize % 4]));
        let bootstrap = Bootstrap::new(target, lengths, settings.seed, sample);

        let mut densities = vec![0.0; 1 + usize::from(kind) % (CANDIDATES / 2)];
        let mutations = 1 + usize::from(mutations) % MUTATIONS;
        let mut scratch = lines(Chains::<All>::scratch(mutations));
        bootstrap.run(0, &mut arena(&mut scratch), &mut densities).expect("the footprint was granted");
        assert!(densities.iter().all(|density| *density >= 0.0 && density.is_finite()), "{densities:?}");
        let mut starts = vec![0; 1 + usize::from(chains) % CHAINS];
        let mean = bootstrap.choose(&densities, &mut starts);
        if mean == 0.0 {
            return Ok(());
        }
        check_starts(&densities, &starts);

        let mut splats = vec![Splat { pixel: 0, radiance: [0.0; 3] }; room(mutations)];
        let chains = Chains::new(bootstrap, (settings.seed, sample), pixels, mutations as u32, 1.0);
        let mut output = ChainsOutput::default();
        chains
            .run(0, &starts, &mut arena(&mut scratch), &mut splats, &mut output)
            .expect("the footprint was granted");
        let mut visits = 0.0;
        for splat in &splats {
            assert!((splat.pixel as usize) < pixels, "{splat:?}");
            assert!(splat.radiance.iter().all(|light| *light >= 0.0 && light.is_finite()), "{splat:?}");
            visits += f64::from(luminance(splat.radiance.into()));
        }
        let expected = (starts.len() * mutations) as f64;
        assert!((visits - expected).abs() < 1e-3 * expected, "{visits} visits of {expected}");
        Ok(())
    })
}

/// Asserts that starts ascend, have a density, and occur in proportion to it, rounded up or down.
fn check_starts(densities: &[f32], starts: &[u32]) {
    assert!(starts.is_sorted(), "{starts:?}");
    let total: f64 = densities.iter().map(|&density| f64::from(density)).sum();
    for (i, &density) in densities.iter().enumerate() {
        let chosen = starts.iter().filter(|&&start| start as usize == i).count() as f64;
        let due = f64::from(density) / total * starts.len() as f64;
        assert!((chosen - due).abs() < 1.0 + 1e-6, "{chosen} starts where {due} are due");
    }
}
