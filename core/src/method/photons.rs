//! Settings and statistics of methods with photon maps.

use crate::findings::Decision::{Limited, Used};
use crate::findings::{Finding, Findings, Value};
use crate::photon::Kernel;
use crate::transport::photon_mapping::deposit::PATHS_PER_TASK;

/// Photon maps of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonSettings {
    /// Weight of a photon by its distance.
    pub kernel: Kernel,
    /// Light paths of a global map; `None`: by the number of pixels.
    pub global: Option<u32>,
    /// Light paths of a caustic map; `None`: by the number of pixels.
    pub caustic: Option<u32>,
}

impl PhotonSettings {
    /// Usual settings.
    pub const DEFAULT: Self = Self { kernel: Kernel::Epanechnikov, global: None, caustic: None };
}

/// Maps of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapUse {
    /// Light paths wanted for each map.
    pub wanted: u64,
    /// Light paths that there was memory for.
    pub given: u64,
    /// Light paths traced, for all maps.
    pub shot: u64,
    /// Photons that they left.
    pub stored: u64,
    /// Fraction of light paths whose photons reach visible surfaces, or those that light them, by a pilot;
    /// `None` without a pilot.
    pub seen: Option<f64>,
    /// The same with lights chosen by power; `None` where they are.
    pub by_power: Option<f64>,
}

impl MapUse {
    /// Maps of `given` tasks of light paths each, of `wanted` ones.
    pub fn of_tasks(wanted: usize, given: usize) -> Self {
        let [wanted, given] =
            [wanted, given].map(|tasks| (tasks as u64).saturating_mul(PATHS_PER_TASK as u64));
        Self { wanted, given, ..Self::default() }
    }

    /// Counts a map of `paths` light paths that left `stored` photons.
    pub fn add(&mut self, paths: usize, stored: usize) {
        self.shot += paths as u64;
        self.stored += stored as u64;
    }

    /// Finding on maps of this kind.
    pub fn finding(&self, topic: &'static str) -> Finding {
        let (decision, reason) = match self.given < self.wanted {
            true => (Limited, "not enough memory: the picture is noisier"),
            false if self.by_power.is_some() => (Used, "emission is guided to the view"),
            false => (Used, ""),
        };
        let limited = |paths: u64| (decision == Limited).then_some(Value::Count(paths));
        Finding::new(topic, decision, reason)
            .with("light_paths", Value::Count(self.shot))
            .with("photons", Value::Count(self.stored))
            .with_some("light_paths_per_map", limited(self.given))
            .with_some("light_paths_wanted", limited(self.wanted))
            .with_some("useful_light_paths", self.seen.map(Value::Fraction))
            .with_some("useful_without_guiding", self.by_power.map(Value::Fraction))
    }
}

/// All photon maps of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonUse {
    /// Maps made; a global map and its caustic map count as one.
    pub maps: u64,
    /// Maps of reflected light, or of all light; `None` where paths find that.
    pub global: Option<MapUse>,
    /// Maps of caustics alone; `None` where the scene makes none.
    pub caustic: Option<MapUse>,
    /// Precomputed irradiances.
    pub irradiances: u64,
}

impl PhotonUse {
    /// Findings on the maps and on those of all light.
    pub fn findings(&self) -> Findings {
        let mut findings = Findings::default();
        let maps =
            Finding::new("photon_maps", Used, "").timed("photons").with("maps", Value::Count(self.maps));
        findings.extend((self.maps > 0).then_some(maps.with_count("irradiances", self.irradiances)));
        findings.extend(self.global.map(|map| map.finding("global_photons")));
        findings
    }
}
