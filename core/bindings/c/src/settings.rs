//! Settings of pictures and of irradiance at points.

use crate::status::HalflightStatus;
use halflight_core::renderer::Reconstruct;
use halflight_core::{Level, LightPart, Method, PointSettings, Settings, Shard};

/// The method with the least predicted error.
pub const HALFLIGHT_AUTO: u32 = 0;
/// Path tracing.
pub const HALFLIGHT_PATH: u32 = 1;
/// Irradiance caching.
pub const HALFLIGHT_IRRADIANCE_CACHE: u32 = 2;
/// Irradiance and radiance caching.
pub const HALFLIGHT_RADIANCE_CACHE: u32 = 3;
/// Photon mapping with final gathering.
pub const HALFLIGHT_PHOTON_MAP: u32 = 4;
/// Stochastic progressive photon mapping.
pub const HALFLIGHT_PROGRESSIVE_PHOTONS: u32 = 5;
/// Light tracing.
pub const HALFLIGHT_LIGHT_TRACING: u32 = 6;
/// Bidirectional path tracing.
pub const HALFLIGHT_BIDIRECTIONAL: u32 = 7;
/// Vertex connection and merging.
pub const HALFLIGHT_VERTEX_MERGING: u32 = 8;
/// Instant radiosity.
pub const HALFLIGHT_INSTANT_RADIOSITY: u32 = 9;
/// Instant radiosity without the light that its bound cuts.
pub const HALFLIGHT_CLAMPED_INSTANT_RADIOSITY: u32 = 10;
/// Metropolis light transport.
pub const HALFLIGHT_METROPOLIS: u32 = 11;

/// Settings of a picture. Zeros but for the size are the usual ones.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `HALFLIGHT_AUTO` and others.
    pub method: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Most segments of a path; 0: no limit.
    pub max_depth: u32,
    /// True for the same bits on every processor.
    pub precise: bool,
    /// True if the picture is reconstructed from the halves of its film.
    pub reconstruct: bool,
    /// Part of the picture: every `shards`th tile from tile `shard` on.
    pub shard: u32,
    /// Number of parts; 0: the whole picture.
    pub shards: u32,
}

impl HalflightSettings {
    pub(crate) fn of_core(&self) -> Result<Settings, HalflightStatus> {
        if !(1..=Settings::MOST_PIXELS).contains(&(u64::from(self.width) * u64::from(self.height))) {
            return Err(HalflightStatus::Size);
        }
        let methods = Method::all();
        let method = methods.get(self.method as usize).ok_or(HalflightStatus::Setting)?;
        Ok(Settings {
            seed: self.seed,
            max_depth: (self.max_depth > 0).then_some(self.max_depth),
            level: level(self.precise),
            shard: Shard::part(self.shard, self.shards.max(1)),
            reconstruct: if self.reconstruct { Reconstruct::Auto } else { Reconstruct::Off },
            ..Settings::new([self.width, self.height]).with_method(*method)
        })
    }
}

/// All light.
pub const HALFLIGHT_ALL_LIGHT: u32 = 0;
/// Light directly from emitters.
pub const HALFLIGHT_DIRECT_LIGHT: u32 = 1;
/// Light that surfaces have scattered.
pub const HALFLIGHT_INDIRECT_LIGHT: u32 = 2;

/// Settings of irradiance at points. Zeros are the usual ones.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightPointSettings {
    /// `HALFLIGHT_ALL_LIGHT` and others.
    pub light: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Most segments of a path; 2 is direct light; 0: no limit.
    pub max_depth: u32,
    /// True for the same bits on every processor.
    pub precise: bool,
}

impl HalflightPointSettings {
    pub(crate) fn of_core(&self) -> Result<PointSettings, HalflightStatus> {
        Ok(PointSettings {
            seed: self.seed,
            max_depth: (self.max_depth > 0).then_some(self.max_depth),
            level: level(self.precise),
            light: match self.light {
                HALFLIGHT_ALL_LIGHT => LightPart::All,
                HALFLIGHT_DIRECT_LIGHT => LightPart::Direct,
                HALFLIGHT_INDIRECT_LIGHT => LightPart::Indirect,
                _ => return Err(HalflightStatus::Setting),
            },
            ..PointSettings::default()
        })
    }
}

fn level(precise: bool) -> Level {
    if precise { Level::BASELINE } else { Level::detect() }
}
