//! Bake files: checkpoints of irradiance at points, and shards to merge. Format: docs/file-container.md.

use super::container::{self, Kind};
use super::film::{get_state, put_state};
use super::hash::Hash;
use super::identity::Identity;
use crate::file_error::FileError;
use crate::save::Patience;
use halflight_core::method::{RenderState, Shard};
use halflight_core::renderer::{IrradianceRenderer, PointFilm};
use halflight_core::scene::Scene;
use halflight_core::{Goal, IrradiancePoint, LightPart, PointMethod, PointSettings};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Read;
use std::path::Path;

const KIND: Kind = Kind { magic: *b"HLBAKE", version: 3, name: "bake" };

/// Why a bake cannot go on.
const CUT: &str = "has a cache that time cut short, whose records cannot be had again: bake anew, with more time or \
                   by paths";

/// Most points, by their memory in a film.
const MOST_POINTS: usize = 1 << 30;

/// State of a bake besides its film and points.
#[derive(Clone, Serialize, Deserialize)]
pub(in crate::render) struct BakeHeader {
    identity: Identity,
    /// Shard number, from 1, and number of shards.
    shard: [u32; 2],
    pub(in crate::render) points: usize,
    pub(in crate::render) spp: u32,
    pub(in crate::render) seconds: f64,
    /// Samples at which tiles are judged next, the error, and 1 for each tile that has reached it.
    decision: u32,
    error: f64,
    finished: Vec<u8>,
    /// Rays, samples and error of the goal by which a cache was chosen.
    goal: (Option<f64>, Option<u32>, Option<f64>),
    /// True if a cache serves the indirect light, and true if there was no time for all of its records.
    source: (bool, bool),
    /// Fractions of back faces: one of each point, or none.
    back_faces: usize,
    /// Bytes of the caller.
    attached: usize,
}

/// Data of a bake beside its film: fractions of back faces in the order of the points as they were given, and
/// bytes of the caller.
#[derive(Clone, Copy)]
pub(in crate::render) struct Beside<'a> {
    pub(in crate::render) back_faces: &'a [f32],
    pub(in crate::render) attached: &'a [u8],
}

impl BakeHeader {
    /// Header of a bake after so many seconds.
    pub(in crate::render) fn new(
        identity: &Identity,
        (points, beside, Goal { rays, samples, error: goal_error }): (usize, Beside, Goal),
        renderer: &IrradianceRenderer,
        seconds: f64,
    ) -> Self {
        let (decision, error, finished) = renderer.decisions();
        let Shard { index, count, .. } = renderer.state().shard;
        Self {
            identity: identity.clone(),
            shard: [index + 1, count],
            points,
            spp: renderer.samples(),
            seconds,
            decision,
            error,
            finished: finished.to_vec(),
            goal: (rays, samples, goal_error),
            source: renderer.source(),
            back_faces: beside.back_faces.len(),
            attached: beside.attached.len(),
        }
    }

    /// All that determines the samples of `points`.
    pub(in crate::render) fn identity(
        scene: &Scene,
        points: &[IrradiancePoint],
        settings: &PointSettings,
    ) -> Identity {
        let mut hash = Hash::default();
        hash.section(bytemuck::cast_slice(points));
        let light = match settings.light {
            LightPart::All => "all",
            LightPart::Direct => "direct",
            LightPart::Indirect => "indirect",
        };
        let method = match settings.method {
            PointMethod::Path => "path",
            PointMethod::IrradianceCache => "irradiance-cache",
            PointMethod::Auto => "auto",
        };
        Identity::of_program()
            .with("points", format_args!("{} {:016x}", points.len(), hash.value()))
            .with("seed", settings.seed)
            .with_some("max-depth", settings.max_depth, "unlimited")
            .with("light", light)
            .with("caustics", if settings.caustics { "on" } else { "off" })
            .with("method", method)
            .with_scene(scene)
    }

    /// `settings` by which the bake is continued: of the same goal, and without a cache that it has left.
    pub(in crate::render) fn continuing(&self, settings: PointSettings) -> PointSettings {
        let ((rays, samples, error), (is_cached, _)) = (self.goal, self.source);
        let method = if is_cached { settings.method } else { PointMethod::Path };
        PointSettings { goal: Goal { rays, samples, error }, method, ..settings }
    }

    pub(in crate::render) fn shard(&self) -> Shard {
        Shard::part(self.shard[0].wrapping_sub(1), self.shard[1])
    }
}

/// Writes the film of `renderer` and what is beside it to `path`, completely or not at all.
pub(in crate::render) fn write(
    path: &Path,
    header: &BakeHeader,
    (renderer, beside): (&IrradianceRenderer, Beside),
    patience: Patience,
) -> Result<(), FileError> {
    container::write(path, &KIND, header, patience, |file| {
        let PointFilm { points, places, state, .. } = renderer.film();
        put_state(file, state, |_, _| Ok(()))?;
        file.put_list(points)?;
        file.put_list(places)?;
        file.put_list(beside.back_faces)?;
        file.put_list(beside.attached)
    })
}

/// True if the file at `path` begins as bake files do.
pub fn is_bake(path: &Path) -> bool {
    let mut magic = [0; 6];
    File::open(path).and_then(|mut file| file.read_exact(&mut magic)).is_ok() && magic == KIND.magic
}

/// A bake file after its header was read.
pub(in crate::render) struct Reader {
    file: container::Reader<'static>,
    pub(in crate::render) header: BakeHeader,
}

/// Points of a bake file in the order of the film, their places, and the bytes of the caller.
pub(in crate::render) struct Tables {
    pub(in crate::render) points: Vec<IrradiancePoint>,
    pub(in crate::render) places: Vec<u32>,
    pub(in crate::render) back_faces: Vec<f32>,
    pub(in crate::render) attached: Vec<u8>,
}

impl Reader {
    /// Opens `path` and reads its header, within `most` bytes.
    pub(in crate::render) fn open(path: &Path, most: usize) -> Result<Self, FileError> {
        let (file, header): (_, BakeHeader) = container::Reader::open(path, &KIND, most)?;
        let Shard { index, count, .. } = header.shard();
        let has_fractions = [0, header.points].contains(&header.back_faces);
        if index >= count || !(1..=MOST_POINTS).contains(&header.points) || !has_fractions {
            return Err(file.damage("there is no such bake"));
        }
        let pixels = PointFilm::pixels(header.points);
        let each = size_of::<IrradiancePoint>() + size_of::<u32>();
        file.expect((pixels * each + header.attached) as u64, 1)?;
        Ok(Self { file, header })
    }

    /// Refuses a bake of another identity or shard.
    pub(in crate::render) fn check(&self, identity: &Identity, shard: Shard) -> Result<(), FileError> {
        let own = (&self.header.identity, self.header.shard());
        if let Some(difference) = Identity::difference_of_shards(own, (identity, shard)) {
            return Err(self.file.refusal(format!("is a bake {difference}")));
        }
        match self.header.source {
            (true, true) => Err(self.file.refusal(CUT)),
            _ => Ok(()),
        }
    }

    /// Refuses a bake that cannot be merged with `first`.
    pub(in crate::render) fn check_sibling(&self, first: &Self) -> Result<(), FileError> {
        let of = |bake: &Self| (bake.header.shard().count, bake.header.spp);
        let others = (&first.header.identity, of(first), first.file.path());
        let difference = self.header.identity.difference_of_siblings("bake", of(self), others);
        difference.map_or(Ok(()), |difference| Err(self.file.refusal(difference)))
    }

    /// Continues the bake in `renderer`, which has the same points.
    pub(in crate::render) fn resume(self, renderer: &mut IrradianceRenderer) -> Result<(), FileError> {
        let BakeHeader { decision, error, finished, .. } = self.header.clone();
        renderer.resume((decision, error, &finished), |state| self.read_into(state).map(|_| ()))
    }

    /// Reads the stored tiles into `state`, a film of as many points, and the tables.
    pub(in crate::render) fn read_into(mut self, state: &mut RenderState) -> Result<Tables, FileError> {
        get_state(&mut self.file, self.header.shard(), state, |_, _| Ok(()))?;
        let pixels = PointFilm::pixels(self.header.points);
        let (points, places) = (self.file.get_list(pixels)?, self.file.get_list(pixels)?);
        let back_faces = self.file.get_list(self.header.back_faces)?;
        let attached = self.file.get_list(self.header.attached)?;
        self.file.finish()?;
        Ok(Tables { points, places, back_faces, attached })
    }
}
