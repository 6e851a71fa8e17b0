//! The mean of path tracing for every choice; the same bits for any division into rounds; errors where memory
//! is short.

use super::{ChainUse, Metropolis, MetropolisSettings, Plan, PrimarySpace};
use crate::Rgb;
use crate::bsdf::All;
use crate::film::Pixel;
use crate::memory::{Buffer, Footprint, OutOfMemory};
use crate::method::path::PathTracing;
use crate::method::tests::{film, lines, with_room};
use crate::method::{Loop, RenderContext, RenderMethod};
use core::sync::atomic::{AtomicU32, Ordering};
use std::vec::Vec;

/// Enough for the pictures here.
const PLENTY: usize = 1 << 24;

/// A picture in `memory` bytes, with `scratch` bytes for tasks, and the use of chains.
fn picture(
    context: &RenderContext,
    (memory, scratch): (usize, Footprint),
    settings: &MetropolisSettings,
    division: [u32; 3],
) -> Result<(Vec<Pixel>, ChainUse), OutOfMemory> {
    let (mut memory, mut scratch) = (lines(memory), lines(scratch.bytes()));
    let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    let mut method = Metropolis::<All>::new(context, settings, &mut buffer, &mut executor, 0)?;
    let pixels = film(context, &mut executor, division, |round| method.round(round))?;
    Ok((pixels, method.chains()))
}

/// The mean radiance of a film, and its standard deviation by the halves of `films` of different seeds.
fn mean(films: &[Vec<Pixel>]) -> (f32, f32) {
    let means: Vec<f32> = films
        .iter()
        .flat_map(|pixels| {
            let count = pixels.iter().filter(|pixel| pixel.count() > 0).count() as f32;
            let sum =
                |of: &dyn Fn(&Pixel) -> Rgb| pixels.iter().map(of).sum::<Rgb>().element_sum() / (3.0 * count);
            [sum(&|pixel| pixel.even.mean()), sum(&|pixel| pixel.odd.mean())]
        })
        .collect();
    let count = means.len() as f32;
    let mean = means.iter().sum::<f32>() / count;
    let squares: f32 = means.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (count * (count - 1.0))).sqrt())
}

#[test]
fn pictures_do_not_depend_on_rounds_or_steps_and_need_memory() {
    with_room(|context| {
        let settings = MetropolisSettings { threshold: 0.0, ..MetropolisSettings::default() };
        let scratch = Metropolis::<All>::scratch();
        let (pixels, chains) = picture(context, (PLENTY, scratch), &settings, [3, 3, 8]).unwrap();
        assert!(pixels.iter().filter(|pixel| pixel.mean().min_element() > 0.0).count() > 200);
        assert!(chains.chains > 0 && chains.share > 0.0);
        for division in [[3, 1, 1], [3, 2, 1]] {
            let (other, _) = picture(context, (PLENTY, scratch), &settings, division).unwrap();
            assert!(other == pixels, "{division:?}");
        }
        // The most is for chains of 256 mutations; those of so small a picture are short.
        let few = Footprint::default().slice::<u8>(scratch.bytes() / 8);
        assert!(picture(context, (PLENTY, few), &settings, [3, 3, 8]).is_err());
        for bytes in [0, 1 << 10, 1 << 14] {
            assert!(picture(context, (bytes, scratch), &settings, [3, 3, 8]).is_err());
        }
    });
}

#[test]
fn any_division_of_light_and_any_space_have_the_mean_of_path_tracing() {
    with_room(|context| {
        let mut scratch = lines(PathTracing::<All>::scratch().bytes());
        let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
        let mut method = PathTracing::<All>::new(context, Some(false), &mut executor).unwrap();
        let pixels = film(context, &mut executor, [1024, 1024, 8], |round| method.round(round)).unwrap();
        let (expected, _) = mean(&[pixels]);
        for space in [PrimarySpace::Multiplexed, PrimarySpace::PathTracing] {
            for threshold in [0.0, 1.0, 8.0, f32::INFINITY] {
                let settings = MetropolisSettings { space, threshold, mutations: 2 };
                let films: Vec<Vec<Pixel>> = (0..4)
                    .map(|seed| {
                        let mut context = *context;
                        context.settings.seed = 100 + seed;
                        let memory = (PLENTY, Metropolis::<All>::scratch());
                        picture(&context, memory, &settings, [128, 128, 8]).unwrap().0
                    })
                    .collect();
                let (found, deviation) = mean(&films);
                // Seven degrees of freedom, eight tests: a level of 1 % for Student's t.
                assert!((found - expected).abs() < 5.0 * deviation, "{settings:?}");
                assert!(deviation < 0.01 * expected, "{deviation}");
            }
        }
    });
}

/// Chains of a picture whose executor is over for its first `asks` questions, and pixels with light.
fn after_questions(asks: u32) -> (u32, usize) {
    let mut found = (0, 0);
    with_room(|context| {
        let (mut memory, mut scratch) = (lines(PLENTY), lines(Metropolis::<All>::scratch().bytes()));
        let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
        let left = AtomicU32::new(asks);
        let is_over =
            || left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1)).is_ok();
        let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch)).until(&is_over);
        let settings = MetropolisSettings::default();
        let mut method = Metropolis::<All>::new(context, &settings, &mut buffer, &mut executor, 0).unwrap();
        let pixels = film(context, &mut executor, [3, 3, 8], |round| method.round(round)).unwrap();
        let lit = pixels.iter().filter(|pixel| pixel.mean().min_element() > 0.0).count();
        found = (method.chains().chains, lit);
    });
    found
}

#[test]
fn without_time_for_the_pilot_a_short_one_or_paths_alone_remain() {
    let (chains, lit) = after_questions(1);
    assert!(chains > 0 && lit > 200, "{chains} {lit}");
    let (chains, lit) = after_questions(2);
    assert!(chains == 0 && lit > 200, "{chains} {lit}");
}

#[test]
fn a_sample_is_as_large_as_its_budget_and_shrinks_to_the_memory() {
    for budget in [1, 100, 400, 1 << 12, 1 << 18, 1 << 24] {
        let plan = Plan::new(budget);
        let points = plan.points();
        assert!(budget < 1 << 12 || points.abs_diff(budget) <= budget / 16, "{plan:?}");
        let bytes = plan.footprint().bytes();
        assert_eq!(plan.within(bytes), plan);
        let half = plan.at_most(points / 2);
        assert!(half.points() <= points / 2 || half.chains == 1, "{half:?}");
        assert_eq!(plan.at_most(points), plan);
        let less = plan.within(bytes / 3);
        assert!(less.footprint().bytes() <= bytes / 3 || less.tasks() == 1, "{less:?}");
        assert!(less.candidates > 0 && less.chains > 0);
    }
}
