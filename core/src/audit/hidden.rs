//! Light that a method at work cannot find, by its techniques.

use crate::bsdf::Features;
use crate::film::{Film, PIXELS_PER_TILE, Tile};
use crate::findings::Decision::LeftOut;
use crate::findings::{Finding, Findings, Value};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::method::caustics::{self, unseen};
use crate::method::hidden_light::{HiddenLight, LackingLight};
use crate::method::metropolis::PrimarySpace;
use crate::method::{Executor, MethodKind, MethodOptions, RenderContext};
use crate::transport::photon_mapping::hidden::Techniques;

/// Samples of a picture whose number is open.
const SAMPLES: u32 = 256;

/// A method at work.
#[derive(Clone, Copy)]
pub struct MethodAtWork<'a> {
    /// Its kind.
    pub kind: MethodKind,
    /// Its options, among those of others.
    pub options: &'a MethodOptions,
    /// Its findings.
    pub findings: &'a Findings,
}

impl MethodAtWork<'_> {
    /// Its techniques beside light samples; `None` if photons find the rest.
    fn techniques(&self) -> Option<Techniques> {
        let decision = |topic| self.findings.get(topic).map(|finding| finding.decision);
        let uses = |topic| decision(topic).is_some_and(|decision| decision != LeftOut);
        let leaves_out = |topic| decision(topic) == Some(LeftOut);
        let all = Techniques { splats: true, connections: true };
        let of_paths = || (!uses("caustic_photons")).then_some(Techniques::default());
        match self.kind {
            MethodKind::Path | MethodKind::IrradianceCache | MethodKind::RadianceCache => of_paths(),
            MethodKind::LightTracing => Some(Techniques { connections: false, ..all }),
            MethodKind::Bidirectional | MethodKind::VertexMerging if leaves_out("light_paths") => of_paths(),
            MethodKind::Bidirectional => Some(all),
            MethodKind::VertexMerging => leaves_out("merging").then_some(all),
            MethodKind::InstantRadiosity | MethodKind::ClampedInstantRadiosity => Some(all),
            MethodKind::Metropolis if self.options.metropolis.space == PrimarySpace::PathTracing => {
                Some(Techniques::default())
            }
            MethodKind::Metropolis => Some(all),
            MethodKind::PhotonMap | MethodKind::ProgressivePhotons => None,
        }
    }

    /// True if the method may lack light.
    pub fn may_lack_light(&self) -> bool {
        self.techniques().is_some()
    }

    /// Working memory of a worker for [`MethodAtWork::hidden_light`].
    pub fn scratch<F: Features>() -> Footprint {
        caustics::scratch::<F>().or(HiddenLight::scratch::<F>())
    }

    /// Measures the light that the method cannot find in a picture of `samples`, or of an open number; `None`
    /// without any, or where `memory` is too small to measure it.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is smaller than [`MethodAtWork::scratch`].
    pub fn hidden_light<'m, F: Features>(
        &self,
        context: &RenderContext,
        samples: Option<u32>,
        memory: &mut impl MemorySource<'m>,
        executor: &mut impl Executor,
    ) -> Result<Option<HiddenLight>, OutOfMemory> {
        let Some(techniques) = self.techniques() else { return Ok(None) };
        if !caustics::are_possible(context.scene) {
            return Ok(None);
        }
        let hidden = HiddenLight::measure::<F>(context, techniques, memory, executor)?;
        // Paths beside records have no photons, and the audit has the same paths.
        let rare = match self.kind.has_records() {
            true => unseen::<F>(context, samples.unwrap_or(SAMPLES).into(), memory, executor)?,
            false => None,
        };
        Ok(match (hidden, rare) {
            (hidden, None) => hidden,
            (None, Some(rare)) => Some(HiddenLight::of_rare(rare)),
            (Some(hidden), Some(rare)) => Some(hidden.with_rare(rare)),
        })
    }
}

impl HiddenLight {
    /// Light that the picture `film` lacks.
    pub fn lacking_in(&self, film: &Film) -> LackingLight {
        let (width, height) = (film.width(), film.height());
        let pixels = film.pixels().chunks(PIXELS_PER_TILE).enumerate().flat_map(|(index, pixels)| {
            let tile = Tile::new(width, height, index);
            pixels.iter().enumerate().filter_map(move |(number, pixel)| {
                let (x, y) = tile.pixel(number)?;
                let at = [f64::from(x), f64::from(y)];
                (pixel.count() > 0).then(|| (at, f64::from(pixel.mean().element_sum()) / 3.0))
            })
        });
        self.lacking([width, height], pixels)
    }
}

impl LackingLight {
    /// Finding on light that a picture lacks.
    pub fn finding(&self) -> Finding {
        let reason =
            "the method cannot find light of points, spots and directions that mirrors or glass hide";
        Finding::new("hidden_light", LeftOut, reason).with("share_of_light", Value::Fraction(self.share))
    }
}
