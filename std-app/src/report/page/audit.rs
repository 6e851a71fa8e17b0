//! What the audit has found: in words, in numbers, as a map.

use super::map::difference;
use super::{fill, parts};
use crate::compare::Shown;
use crate::drive::{Audited, Deviation, Region};
use crate::report::Run;
use crate::report::words::{number, plural, readable_seconds};
use crate::save::Image;

/// The section of the audit; nothing where there was none.
pub(super) fn section(run: &Run) -> String {
    let Some(audit) = &run.result.audit else { return String::new() };
    let facts = [
        ("Bias, as relMSE", number(audit.bias.relmse.max(0.0), 2)),
        ("With 95&#8239;% at most", number(audit.bias.upper, 2)),
        ("Noise, as relMSE", number(audit.noise.relmse, 2)),
        ("The whole picture is off by", percent(&audit.whole)),
        ("Time of the audit", readable_seconds(audit.seconds)),
    ];
    let pixels =
        plural(audit.pixels.into(), "pixel") + ", with " + &plural(audit.samples.into(), "sample") + " each,";
    fill(
        include_str!("audit.html"),
        &[("words", &words(audit, run.doubt())), ("facts", &parts::facts(&facts)), ("pixels", &pixels)],
    )
}

/// The verdict.
fn words(audit: &Audited, doubt: Option<&str>) -> String {
    if let Some(doubt) = doubt.filter(|_| audit.is_blind) {
        return format!("No verdict: {doubt}. The error is that of noise.");
    }
    if !audit.is_biased() {
        let least = number(audit.bias.detectable, 1);
        return format!("No bias was found. One of less than {least} in relMSE might not have been.");
    }
    let biased = audit.regions.iter().filter(|region| region.is_biased);
    let far = |a: &&Region, b: &&Region| a.deviation.mean.abs().total_cmp(&b.deviation.mean.abs());
    let (count, worst) = (biased.clone().count(), biased.max_by(far));
    let mut words = String::from("<strong>This picture is biased</strong>");
    match worst {
        Some(worst) => {
            words += &format!(
                ": {} of {} regions are, by {} in the worst.",
                count,
                audit.regions.len(),
                percent(&worst.deviation)
            );
        }
        None if audit.whole_is_biased() => words += &format!(": by {} as a whole.", percent(&audit.whole)),
        None => words += ", by too little to say where.",
    }
    if let Some(doubt) = doubt {
        words += &format!(" Or not: {doubt}.");
    }
    words
}

/// A deviation with its standard error.
fn percent(deviation: &Deviation) -> String {
    let sign = if deviation.mean < 0.0 { '−' } else { '+' };
    let [mean, error] = [deviation.mean.abs(), deviation.error].map(|value| number(100.0 * value, 2));
    format!("{sign}{mean}&#8239;% ± {error}&#8239;%")
}

/// The regions in false colours, where there is a bias. Those that chance may explain are white.
pub(super) fn map(run: &Run) -> String {
    let Some(audit) = run.result.audit.as_ref().filter(|audit| audit.is_biased()) else {
        return String::new();
    };
    let Image { width, height, .. } = run.result.image;
    let mut values = Image::black(width, height);
    let told = |region: &&Region| region.deviation.mean.abs() > 2.0 * region.deviation.error;
    for region in audit.regions.iter().filter(told) {
        for y in region.y..region.y + region.height {
            let row = (y * width) as usize;
            values.pixels[row + region.x as usize..row + (region.x + region.width) as usize]
                .fill([region.deviation.mean as f32; 3]);
        }
    }
    difference(
        &values,
        Shown::Relative,
        "Bias",
        "Blue where a region is too dark, red where it is too bright, relative to what it shows; white where it is off \
         by less than two standard errors. Of regions without a bias one in twenty has a colour.",
    )
}
