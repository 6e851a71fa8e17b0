//! Light that a method cannot find, measured before the picture, as a part of its error and as a finding.

use super::RenderError;
use super::memory::Memory;
use super::method::{Method, RenderSetup};
use super::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::film::{Film, PIXELS_PER_TILE, Tile};
use halflight_core::findings::Decision::LeftOut;
use halflight_core::findings::{Finding, Findings, Value};
use halflight_core::memory::MemorySource;
use halflight_core::method::caustics::{self, unseen};
use halflight_core::method::hidden_light::{HiddenLight, LackingLight};
use halflight_core::method::metropolis::PrimarySpace;
use halflight_core::transport::photon_mapping::hidden::Techniques;

/// Samples of a picture whose number is open.
const SAMPLES: u32 = 256;

/// Topic of the finding.
const TOPIC: &str = "hidden_light";

/// Techniques of `method` with its `findings` beside light samples; `None` if photons find the rest.
fn techniques(method: Method, setup: &RenderSetup, findings: &Findings) -> Option<Techniques> {
    let uses = |topic| findings.get(topic).is_some_and(|finding| finding.decision != LeftOut);
    let leaves_out = |topic| findings.get(topic).is_some_and(|finding| finding.decision == LeftOut);
    let all = Techniques { splats: true, connections: true };
    let of_paths = || (!uses("caustic_photons")).then_some(Techniques::default());
    match method {
        Method::Path | Method::IrradianceCache | Method::RadianceCache => of_paths(),
        Method::LightTracing => Some(Techniques { connections: false, ..all }),
        Method::Bidirectional | Method::VertexMerging if leaves_out("light_paths") => of_paths(),
        Method::Bidirectional => Some(all),
        Method::VertexMerging => leaves_out("merging").then_some(all),
        Method::InstantRadiosity | Method::ClampedInstantRadiosity => Some(all),
        Method::Metropolis if setup.settings.metropolis.space == PrimarySpace::PathTracing => {
            Some(Techniques::default())
        }
        Method::Metropolis => Some(all),
        Method::PhotonMap | Method::ProgressivePhotons => None,
    }
}

/// Measures the light that `method` with its `findings` cannot find; `None` without any.
pub(super) fn measure<F: Features>(
    setup: &RenderSetup,
    memory: &mut Memory,
    method: Method,
    findings: &Findings,
) -> Result<Option<HiddenLight>, RenderError> {
    let context = setup.context();
    let Some(techniques) = techniques(method, setup, findings) else { return Ok(None) };
    let (workers, scratch) = (setup.workers, caustics::scratch::<F>());
    let lent = scratch.bytes().saturating_mul(workers.count());
    if !caustics::are_possible(setup.scene) || lent > memory.available() {
        return Ok(None);
    }
    let mut own = memory.within();
    let mut scratch = own.take_each("hidden light", scratch, workers.count())?;
    let mut executor = Threads::new(workers, &mut scratch);
    let hidden = HiddenLight::measure::<F>(&context, techniques, &mut own, &mut executor)?;
    // Paths beside records have no photons, and the audit has the same paths.
    let rare = match method.has_records() {
        true => {
            let samples = f64::from(setup.goal().samples.unwrap_or(SAMPLES));
            unseen::<F>(&context, samples, &mut own, &mut executor)?
        }
        false => None,
    };
    Ok(match (hidden, rare) {
        (hidden, None) => hidden,
        (None, Some(rare)) => Some(HiddenLight::of_rare(rare)),
        (Some(hidden), Some(rare)) => Some(hidden.with_rare(rare)),
    })
}

/// Light of which the picture `film` lacks `hidden`.
pub(super) fn lacking(hidden: &HiddenLight, film: &Film) -> LackingLight {
    let (width, height) = (film.width(), film.height());
    let pixels = film.pixels().chunks(PIXELS_PER_TILE).enumerate().flat_map(|(index, pixels)| {
        let tile = Tile::new(width, height, index);
        pixels.iter().enumerate().filter_map(move |(number, pixel)| {
            let (x, y) = tile.pixel(number)?;
            (pixel.count() > 0)
                .then(|| ([f64::from(x), f64::from(y)], f64::from(pixel.mean().element_sum()) / 3.0))
        })
    });
    hidden.lacking([width, height], pixels)
}

/// Finding on light that a picture lacks.
pub(super) fn finding(lacks: &LackingLight) -> Finding {
    let reason = "the method cannot find light of points, spots and directions that mirrors or glass hide";
    Finding::new(TOPIC, LeftOut, reason).with("share_of_light", Value::Fraction(lacks.share))
}
