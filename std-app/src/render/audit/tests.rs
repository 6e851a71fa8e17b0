//! The audit finds bias where it exists, and nowhere else.

use crate::load::{LoadOptions, load};
use crate::render::{AuditWork, Audited, Checkpoint, Ending, Method, Reconstruct, RenderResult};
use crate::render::{Settings, Shard, Stop, merge, render};
use core::sync::atomic::AtomicBool;
use halflight_core::estimate::Difference;

const SIZE: u32 = 64;

/// A method that converges to wrong radiance, whose place a deliberately biased one takes.
const WRONG: Method = Method::ClampedInstantRadiosity;

fn picture(settings: Settings) -> RenderResult {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.obj");
    let loaded = load(scene.as_ref(), &LoadOptions::default()).unwrap();
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());

    render(&scene, &settings, &mut |_| {}, &AtomicBool::new(false)).unwrap()
}

fn settings(method: Method, spp: u32, seed: u32, audit: f64) -> Settings {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    Settings {
        method: Some(method),
        is_wrong: method == WRONG,
        stop,
        seed,
        audit: Some(audit),
        reuse: Some(false),
        width: SIZE,
        height: SIZE,
        reconstruct: Reconstruct::Off,
        ..Settings::default()
    }
}

fn audited(settings: Settings) -> Audited {
    picture(settings).audit.unwrap()
}

#[test]
fn a_region_that_is_a_tenth_too_bright_is_found() {
    let (mut held, mut sum) = (0, 0.0);
    let mut truth = 0.0;
    for seed in 2..6 {
        let result = picture(settings(WRONG, 128, seed, 0.3));
        let (image, audit) = (&result.image, result.audit.as_ref().unwrap());
        assert!(audit.is_biased(), "{audit:?}");
        // The same samples without the factor are an exact reference.
        let path = picture(settings(Method::Path, 128, seed, 0.0)).image;
        truth = Difference::between(image.colours(), path.colours()).relmse;
        held += u32::from((audit.bias.lower..audit.bias.upper).contains(&truth));
        sum += audit.bias.relmse;
        for region in &audit.regions {
            let deviation = region.deviation;
            let expected = if 2 * region.x >= SIZE { 0.1 } else { 0.0 };
            // Five standard errors, plus the reduction by an overestimated denominator.
            assert!((deviation.mean - expected).abs() < 5.0 * deviation.error + 0.02, "{region:?}");
            assert!(!region.is_biased || 2 * region.x >= SIZE, "{region:?}");
        }
        assert!(audit.regions.iter().filter(|region| region.is_biased).count() >= 2, "{:?}", audit.regions);
    }
    // Probability of two of four outside a 95 % interval: 1.4 %; of a mean off by half: 0.1 %.
    assert!(held >= 3, "{held}");
    assert!((0.5..1.5).contains(&(sum / 4.0 / truth)), "{sum} {truth}");
}

#[test]
fn path_tracing_is_found_unbiased() {
    let runs = 60;
    let found = (0..runs).filter(|&seed| audited(settings(Method::Path, 16, seed, 0.2)).is_biased()).count();
    // At a level of 5 %, three of 60 are expected; more than 8 have a probability of 0.4 %.
    assert!(found <= 8, "{found} of {runs}");
}

#[test]
fn an_error_below_the_bias_is_out_of_reach() {
    let stop = Stop { spp: Some(4096), error: Some(0.001), ..Stop::default() };
    let result = picture(Settings { stop, ..settings(WRONG, 0, 5, 0.2) });
    assert_eq!(result.ending, Ending::Biased);
    assert!(result.spp < 1024 && result.error.unwrap().upper > 0.001, "{} {:?}", result.spp, result.error);
}

#[test]
fn an_error_above_the_bias_is_the_sum_of_both() {
    let stop = Stop { spp: Some(4096), error: Some(0.02), ..Stop::default() };
    let result = picture(Settings { stop, ..settings(WRONG, 0, 5, 0.2) });
    let (audit, error) = (result.audit.unwrap(), result.error.unwrap());
    assert_eq!((result.ending, error), (Ending::Done, audit.total));
    assert!(error.upper <= 0.02 && audit.noise.relmse <= error.relmse, "{} {audit:?}", result.spp);
}

#[test]
fn an_audit_that_alone_keeps_a_picture_from_its_end_goes_on() {
    // Total work with the default share, and with the same share requested explicitly, over several seeds.
    let stop = Stop { spp: Some(4096), error: Some(0.02), ..Stop::default() };
    let work = |audit: Option<f64>| {
        let mut sums = (0, 0);
        for seed in 3..8 {
            let result = picture(Settings { stop, audit, ..settings(WRONG, 0, seed, 0.0) });
            assert!(
                result.ending == Ending::Done && result.error.unwrap().upper <= 0.02,
                "{:?}",
                result.audit
            );
            sums = (sums.0 + result.counters.all_rays(), sums.1 + result.audit.unwrap().work.rays);
        }
        sums
    };
    let ((picture, audit), (before, share)) = (work(None), work(Some(0.05)));
    assert!(20 * (picture + audit) < 19 * (before + share), "{picture} {audit}, {before} {share}");
    assert!(5 * audit * before > 6 * share * picture, "{picture} {audit}, {before} {share}");
    assert!(share <= before / 18, "{before} {share}");
}

#[test]
fn a_large_picture_that_is_hardly_audited_has_few_pixels_audited() {
    let large = |audit| picture(Settings { width: 512, height: 416, ..settings(WRONG, 8, 3, audit) });
    let [few, all] = [0.001, 0.3].map(|share| large(share).audit.unwrap());
    // Twelve pixels for each of 8 x 8 regions, and one per tile.
    assert_eq!([few.pixels, all.pixels], [768, 832]);
    assert_eq!(few.regions.len(), 64);
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let stop = Stop { error: Some(0.03), ..Stop::default() };
    for audit in [None, Some(0.1)] {
        let [one, three] = [1, 3].map(|threads| {
            let threads = Some(threads);
            let result = picture(Settings { stop, threads, audit, ..settings(WRONG, 0, 2, 0.0) });
            (
                result.image,
                result.audit.map(|audit| Audited { work: AuditWork { seconds: 0.0, ..audit.work }, ..audit }),
            )
        });
        assert!(one == three, "{audit:?}");
    }
}

#[test]
fn the_share_of_the_work_is_kept() {
    let result = picture(settings(WRONG, 256, 3, 0.05));
    let audit = result.audit.unwrap();
    let rays = result.counters.all_rays() as f64;
    let stop = Stop { error: Some(1e-9), spp: Some(128), ..Stop::default() };
    let by_rays = picture(Settings { stop, audit: Some(0.05), ..settings(Method::Path, 0, 3, 0.05) });
    let exact = by_rays.audit.unwrap().work.rays as f64 / by_rays.counters.all_rays() as f64;
    assert!((0.045..0.0535).contains(&exact), "{exact}");
    // Measured by the clock on a busy machine: only the order of magnitude.
    assert!((0.01..0.25).contains(&(audit.work.rays as f64 / rays)), "{audit:?}");
}

#[test]
fn no_audit_where_none_is_asked_for() {
    assert!(picture(Settings { audit: None, ..settings(Method::Path, 8, 0, 0.1) }).audit.is_none());
    assert!(picture(settings(WRONG, 8, 0, 0.0)).audit.is_none());
    assert!(picture(Settings { audit: None, ..settings(WRONG, 8, 0, 0.1) }).audit.is_some());
}

#[test]
fn shards_are_audited_together() {
    let folder = std::env::temp_dir().join(format!("halflight-audit-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let films: Vec<_> = (0..3).map(|shard| folder.join(format!("{shard}.film"))).collect();
    let settings = settings(WRONG, 128, 3, 0.3);
    for (index, film) in films.iter().enumerate() {
        let checkpoint = Some(Checkpoint { path: film.clone(), every: 60.0 });
        let shard = Shard::part(index as u32, 3);
        picture(Settings { shard, checkpoint, ..settings.clone() });
    }
    let merged = merge(&films).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let (audit, whole) = (merged.audit.unwrap(), audited(settings));
    // 256 of the whole, rounded up in each shard.
    assert!((256..259).contains(&audit.pixels), "{audit:?}");
    assert_eq!((audit.noise, merged.error), (whole.noise, Some(audit.total)));
    for region in &audit.regions {
        let expected = if 2 * region.x >= SIZE { 0.1 } else { 0.0 };
        assert!((region.deviation.mean - expected).abs() < 5.0 * region.deviation.error + 0.02, "{region:?}");
        assert!(!region.is_biased || 2 * region.x >= SIZE, "{region:?}");
    }
    assert!(audit.regions.iter().filter(|region| region.is_biased).count() >= 2, "{:?}", audit.regions);
}
