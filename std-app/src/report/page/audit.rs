//! Audit of the bias: verdict, numbers and a map.

use super::map::difference;
use super::parts;
use crate::compare::Shown;
use crate::render::{Audited, Deviation, Region};
use crate::report::Run;
use crate::report::quantity::{number, plural, readable_seconds};
use crate::save::Image;
use maud::{Markup, html};

/// Section of the audit; empty without one.
pub(super) fn section(run: &Run) -> Markup {
    let Some(audit) = &run.result.audit else { return html! {} };
    let facts = [
        ("Bias, as relMSE", number(audit.bias.relmse.max(0.0), 2)),
        ("Upper bound, 95\u{202f}%", number(audit.bias.upper, 2)),
        ("Noise, as relMSE", number(audit.noise.relmse, 2)),
        ("Deviation of the whole picture", percent(&audit.whole)),
        ("Time of the audit", readable_seconds(audit.work.seconds)),
    ];
    html! {
        section {
            h2 { "Audit of the bias" }
            p { (verdict(audit, run.doubt())) }
            dl class="facts row" { (parts::facts(&facts)) }
            p.note {
                "Unbiased path tracing renders " (plural(audit.pixels.into(), "pixel")) " with "
                (plural(audit.work.samples.into(), "sample")) " each, in step with the picture. Differences \
                beyond the noise of both are bias. Means of regions are more certain than pixels, so a bias \
                of one sign is detected before one that averages out. A bias below the noise is not detected."
            }
        }
    }
}

fn verdict(audit: &Audited, doubt: Option<&str>) -> Markup {
    if let Some(doubt) = doubt.filter(|_| audit.is_blind) {
        return html! { "No verdict: " (doubt) ". The error is that of the noise." };
    }
    if !audit.is_biased() {
        let least = number(audit.bias.detectable, 1);
        return html! { "No bias was found. A relMSE below " (least) " may remain undetected." };
    }
    let biased = audit.regions.iter().filter(|region| region.is_biased);
    let deviation = |region: &&Region| region.deviation.mean.abs();
    let worst = biased.clone().max_by(|a, b| deviation(a).total_cmp(&deviation(b)));
    html! {
        strong { "This picture is biased" }
        @if let Some(worst) = worst {
            ": " (biased.count()) " of " (audit.regions.len()) " regions, the worst by "
            (percent(&worst.deviation)) "."
        } @else if audit.whole_is_biased() {
            ": by " (percent(&audit.whole)) " as a whole."
        } @else {
            ", but in no single region significantly."
        }
        @if let Some(doubt) = doubt { " This is uncertain: " (doubt) "." }
    }
}

/// Deviation with its standard error.
fn percent(deviation: &Deviation) -> String {
    let sign = if deviation.mean < 0.0 { '−' } else { '+' };
    let [mean, error] = [deviation.mean.abs(), deviation.error].map(|value| number(100.0 * value, 2));
    format!("{sign}{mean}\u{202f}% ± {error}\u{202f}%")
}

/// Map of the deviations of regions, if a bias was found. Regions within two standard errors are white.
pub(super) fn map(run: &Run) -> Markup {
    let Some(audit) = run.result.audit.as_ref().filter(|audit| audit.is_biased()) else {
        return html! {};
    };
    let Image { width, height, .. } = run.result.image;
    let mut values = Image::black(width, height);
    let is_shown = |region: &&Region| region.deviation.mean.abs() > 2.0 * region.deviation.error;
    for region in audit.regions.iter().filter(is_shown) {
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
        "Relative deviation of regions: blue is too dark, red is too bright, white is within two standard \
        errors. One unbiased region in twenty has a colour.",
    )
}
