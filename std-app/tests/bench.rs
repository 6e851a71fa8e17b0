//! Reports of the benchmarks.

use halflight::bench::eigen::run;
use halflight_core::Level;

#[test]
fn every_level_is_measured() {
    for level in Level::detect().and_below() {
        let report = run(level);
        assert_eq!(report.level, level);
        assert!(report.ours.sym2 > 0.0 && report.ours.sym3 > 0.0, "{report:?}");
    }
}
