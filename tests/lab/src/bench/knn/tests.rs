//! Distribution of the photons, and agreement of single and batched queries and of other libraries.

use super::measure::measure;
use super::*;
use halflight::pages::Pages;
use halflight_core::bvh::Serial;

const PHOTONS: usize = 20_000;
const QUERIES: usize = 400;

#[test]
fn three_tenths_of_the_photons_are_in_the_caustic() {
    let data = Data::new(100_000, 10);
    let near = |surfel: &&Surfel| {
        surfel.normal == glam::Vec3::Y && surfel.position.distance(glam::Vec3::new(0.7, 0.0, 0.6)) <= 0.05
    };
    let fraction = data.photons.iter().filter(near).count() as f64 / 100_000.0;
    // 0.3 plus 0.7 times the fraction 0.0014 of the caustic's area; five standard deviations of a count.
    assert!((fraction - 0.301).abs() < 0.0075, "{fraction}");
}

#[test]
fn single_and_batched_queries_find_as_many_photons() {
    let data = Data::new(PHOTONS, QUERIES);
    let records = ours::records(&data.photons);
    let mut memory = Pages::default();
    let map = ours::build(&records, &mut memory, &Serial).unwrap();
    let level = Level::detect();
    for task in Task::ALL {
        let found = ours::Single { map: &map, level }.run(task, &data).unwrap();
        assert_eq!(ours::Batched { map: &map, level }.run(task, &data).unwrap(), found, "{task:?}");
        if let Task::Nearest { k, radius } = task
            && !radius.is_finite()
        {
            assert_eq!(found, (k * QUERIES) as u64);
        }
    }
}

#[test]
fn report_has_every_task_and_rivals_find_as_many_photons() {
    let data = Data::new(PHOTONS, QUERIES);
    let report = measure(&data, Level::BASELINE).unwrap();
    for speeds in [&report.single, &report.batched] {
        assert_eq!(speeds.len(), Task::ALL.len());
        assert!(speeds.iter().all(|speed| speed.queries_per_second > 0.0 && speed.photons > 0.0));
    }
    assert!(report.build_seconds > 0.0 && report.bytes < 24 * PHOTONS);
    assert!(report.build_seconds_on_two > 0.0);
    let expected = usize::from(cfg!(feature = "kiddo")) + usize::from(cfg!(feature = "nanoflann"));
    assert_eq!(report.rivals.len(), expected);
    for rival in &report.rivals {
        for (ours, theirs) in report.single.iter().zip(&rival.speeds) {
            if let Task::Nearest { .. } = ours.task {
                assert_eq!(theirs.photons, ours.photons, "{} {:?}", rival.name, ours.task);
            }
        }
    }
}
