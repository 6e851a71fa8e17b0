//! Identity of a film's picture: films can be continued and merged only if their identities agree.

use crate::render::{Method, Settings, fingerprint};
use halflight_core::scene::Scene;
use halflight_core::transport::PathSettings;
use serde::{Deserialize, Serialize};

/// Everything that determines the bits of a film, except its samples.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::render) struct Identity {
    /// Version of the program.
    version: String,
    pub(super) method: String,
    pub(super) width: u32,
    pub(super) height: u32,
    seed: u32,
    max_depth: Option<u32>,
    /// Requested choices; their outcome follows from the scene.
    reuse: Option<bool>,
    windows: Option<bool>,
    /// Settings of the method.
    settings: String,
    /// Fingerprint of the scene's content.
    scene: String,
    camera: String,
}

impl Identity {
    /// Identity of a render; `loaded` is the fingerprint of the cache it begins with.
    pub(in crate::render) fn of(
        scene: &Scene,
        method: Method,
        paths: &PathSettings,
        settings: &Settings,
        loaded: Option<String>,
    ) -> Self {
        let mut own = settings.of_method(method);
        if let Some(loaded) = loaded {
            own += &format!(", loaded {loaded}");
        }
        let joined = settings.caustics && method.may_join_caustics();
        let caustics = if joined { ", caustics" } else { "" };
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            method: method.name().into(),
            width: paths.width,
            height: paths.height,
            seed: paths.seed,
            max_depth: settings.max_depth,
            reuse: settings.reuse,
            windows: settings.environment_visibility,
            settings: format!("{paths:?}{own}{caustics}"),
            scene: fingerprint::scene(scene),
            camera: fingerprint::camera(&scene.camera),
        }
    }

    /// First difference between `self`, the identity of a film file, and `other`, in words.
    pub(super) fn difference(&self, other: &Self) -> Option<String> {
        let depth = |depth: Option<u32>| depth.map_or("no limit of".into(), |depth| depth.to_string());
        let choice = |asked: Option<bool>| match asked {
            None => "auto".into(),
            Some(true) => "on".into(),
            Some(false) => "off".into(),
        };
        let size = |identity: &Self| format!("{}x{} pixels", identity.width, identity.height);
        let said =
            |what: &str, of: String, is: String| (of != is).then(|| format!("of {what}{of}, not {is}"));
        said("version ", self.version.clone(), other.version.clone())
            .or(said("method ", self.method.clone(), other.method.clone()))
            .or(said("", size(self), size(other)))
            .or(said("seed ", self.seed.to_string(), other.seed.to_string()))
            .or(said("max-depth ", depth(self.max_depth), depth(other.max_depth)))
            .or(said("reuse ", choice(self.reuse), choice(other.reuse)))
            .or(said("windows ", choice(self.windows), choice(other.windows)))
            .or((self.scene != other.scene)
                .then(|| "of another scene, or the scene has changed since".into()))
            .or((self.camera != other.camera).then(|| "seen by another camera".into()))
            .or(said("settings ", self.settings.clone(), other.settings.clone()))
    }
}
