//! Snapshot of relMSE of each method in each scene for several sample budgets, against plain path tracing.
//! Pictures are deterministic, so the numbers are too.
//!
//!     SNAPSHOT=write cargo test --profile quick -p halflight-tests --test main table::errors::
//!
//! rewrites `tests/tests/errors.txt`; a commit that changes a number shows it in its diff.

use super::METHODS;
use super::pictures::{is_small, picture, reference};
use super::scenes::SCENES;
use halflight_tests::snapshot;

/// Budgets in samples per pixel.
const BUDGETS: [u32; 3] = [1, 8, 32];

/// The table as it is today.
fn table() -> String {
    let mut text =
        "# relMSE at 32 x 32 pixels, seed 0, against plain path tracing with 1024 samples; rounded\n"
            .to_owned();
    text += &format!("{:<16} {:<18}", "# scene", "method");
    BUDGETS.iter().for_each(|spp| text += &format!(" {:>9}", format!("{spp} spp")));
    text += "\n";
    for scene in SCENES {
        for row in METHODS {
            text += &format!("{:<16} {:<18}", scene.name, row.method.name());
            for spp in BUDGETS {
                let error = reference(scene).error(&picture(scene, row.method, spp, |_| ()).image);
                text += &format!(" {error:>9.1e}");
            }
            text += "\n";
        }
    }
    text
}

#[test]
fn errors_are_those_of_the_snapshot() {
    if is_small() {
        println!("skipped: small pictures have other errors");
        return;
    }
    snapshot::check("errors.txt", &table());
}
