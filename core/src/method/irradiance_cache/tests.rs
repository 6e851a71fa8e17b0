//! Irradiance caching on known scenes and in little memory.

use super::*;
use crate::bsdf::DiffuseOnly;
use crate::cache::irradiance::Metric;
use crate::memory::{Buffer, Line};
use crate::method::test_box::{SIDE, cornell, furnace, with_box};
use crate::method::{Loop, RenderState, Shard};
use crate::scene::Material;
use std::vec;
use std::vec::Vec;

type Caching<'a> = IrradianceCaching<'a, DiffuseOnly>;

const SETTINGS: CacheSettings = CacheSettings {
    records: None,
    metric: Metric::Halflight,
    error: 1e-4,
    strata: 8,
    fewest: 1000,
    reserve: 0,
    widens: true,
    lobes: None,
    picture: None,
};

fn lines(settings: &CacheSettings) -> usize {
    let caches = CacheBuilder::footprint(settings.fewest, None);
    let film = RenderState::footprint(SIDE, SIDE);
    let all = Caching::scratch(settings).and(film).and(settings.gathering_footprint());
    all.and(caches).and(caches).bytes() / 64
}

/// Renders in `lines` lines of memory, in rounds to these numbers of samples, `step` samples of a tile at
/// a time. Returns the mean radiance of each pixel, and the number of records.
fn render(
    materials: [Material; 4],
    settings: &CacheSettings,
    lines: usize,
    rounds: &[u32],
    step: u32,
) -> Result<(Vec<[f32; 3]>, usize), OutOfMemory> {
    let mut lines = vec![Line([0; 64]); lines];
    with_box(materials, |context| {
        let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut lines));
        let scratch = Caching::scratch(settings);
        let scratch = buffer.take("paths", scratch)?.slice::<u8>(scratch.bytes())?;
        let mut film = buffer.take("film", RenderState::footprint(SIDE, SIDE))?;
        let mut state = RenderState::new(SIDE, SIDE, Shard::WHOLE, &mut film)?;
        let mut method = Caching::new(context, settings, &mut buffer)?;
        let mut executor = Loop::new(scratch);
        for &target in rounds {
            method.round(&mut Round { executor: &mut executor, state: &mut state, target, step })?;
        }
        assert_eq!(state.spp(), *rounds.last().unwrap());
        let records = method.caches().map(|cache| cache.records().len());
        assert!(records.iter().all(|records| (50..settings.fewest).contains(records)), "{records:?}");
        let mean = |pixel: &crate::film::Pixel| pixel.mean().to_array();
        Ok((state.film.pixels().iter().map(mean).collect(), records[0] + records[1]))
    })
}

#[test]
fn a_cornell_box_has_the_same_bits_for_any_rounds_and_steps() {
    let at_once = render(cornell(), &SETTINGS, lines(&SETTINGS), &[6], 6).unwrap();
    assert!(render(cornell(), &SETTINGS, lines(&SETTINGS), &[1, 2, 6], 1).unwrap() == at_once);
}

#[test]
fn a_furnace_has_the_radiance_of_the_series() {
    let (pixels, _) = render(furnace(), &SETTINGS, lines(&SETTINGS), &[8], 8).unwrap();
    let mean = pixels.iter().flatten().sum::<f32>() / (3 * pixels.len()) as f32;
    assert!((mean / 2.0 - 1.0).abs() < 0.01, "{mean}");
}

#[test]
fn a_picture_with_time_has_the_bits_of_the_finer_resolution_that_it_chooses() {
    let of = |resolution: CacheResolution, picture| {
        let (strata, error) = (resolution.strata as usize, resolution.error);
        let settings = CacheSettings { strata, error, picture, fewest: 4000, ..SETTINGS };
        render(cornell(), &settings, lines(&settings), &[2], 2).unwrap()
    };
    let coarsest = of(CacheResolution::COARSEST, None);
    let with_time = |rays| of(CacheResolution::COARSEST, Some(CachedPicture::of_time(rays)));
    assert!(with_time(1e12) == of(CacheResolution::FINEST, None));
    assert!(with_time(1e3) == coarsest && with_time(1e12) != coarsest);
}

#[test]
fn exact_memory_is_enough_and_a_line_less_is_an_error() {
    assert!(render(cornell(), &SETTINGS, lines(&SETTINGS), &[2], 2).is_ok());
    for less in [1, 100, lines(&SETTINGS) / 2, lines(&SETTINGS)] {
        assert!(render(cornell(), &SETTINGS, lines(&SETTINGS) - less, &[2], 2).is_err(), "{less}");
    }
}
