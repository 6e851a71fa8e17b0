//! Merging of the shards of a bake, with the bits of a single one.

use super::error::{FileError, RenderError};
use super::files::{BakeReader, Tables};
use super::points::Baked;
use super::threads::{Pool, Workers};
use crate::memory::{Budget, lines};
use halflight_core::IrradiancePoint;
use halflight_core::findings::Findings;
use halflight_core::memory::Arena;
use halflight_core::method::Shard;
use halflight_core::renderer::PointFilm;
use std::path::{Path, PathBuf};

/// Merges the bakes in `files`, in any order. Returns the points in the order of the values, and the bytes
/// that the caller attached, as well.
///
/// # Errors
/// Names the first file that does not belong to the first one and why, or missing and repeated shards.
pub(crate) fn merge_points(files: &[PathBuf]) -> Result<(Baked, Vec<IrradiancePoint>, Vec<u8>), RenderError> {
    let most = Budget::new(None).limit();
    let bakes = files.iter().map(|file| BakeReader::open(file, most)).collect::<Result<Vec<_>, _>>()?;
    let (Some(first), Some(name)) = (bakes.first(), files.first()) else { return Err(RenderError::Shard) };
    bakes.iter().try_for_each(|bake| bake.check_sibling(first))?;
    let count = first.header.points;
    let shards: Vec<Shard> = bakes.iter().map(|bake| bake.header.shard()).collect();
    check_complete(&shards, name)?;

    let footprint = PointFilm::footprint(count);
    if footprint.bytes() > most {
        return Err(RenderError::Memory { needed: footprint.bytes(), available: most });
    }
    let mut lines = lines(footprint)?;
    let (mut arena, mut seconds) = (Arena::over(&mut lines), 0.0);
    let mut film = PointFilm::new(count, (&[], &[]), Shard::WHOLE, &mut arena)?;
    let mut tables = None;
    for bake in bakes {
        seconds += bake.header.seconds;
        tables = Some(bake.read_into(&mut film.state)?);
    }
    let Some(Tables { points, places, back_faces, attached }) = tables else {
        return Err(RenderError::Shard);
    };
    (film.points, film.places) = (&points, &places);
    let pool = Pool::new(None)?;
    Workers::new(&pool).estimating(|executor| film.estimate(executor, 0.0));
    let baked = Baked {
        values: film.values().collect(),
        back_faces,
        tiles: [film.state.tiles(), 0],
        findings: Findings::default(),
        counters: film.state.counters,
        seconds: [0.0, seconds],
        is_interrupted: false,
        unsaved: None,
    };
    // Replicates of a point differ in their numbers.
    let replicates = (points.len() / count).max(1);
    let of_values = places.iter().step_by(replicates);
    let points = of_values.map(|place| points.get(*place as usize).copied().unwrap_or_default()).collect();
    Ok((baked, points, attached))
}

/// # Errors
/// Names the first shard that is missing or there more than once, and `name`, the first file.
pub(super) fn check_complete(shards: &[Shard], name: &Path) -> Result<(), FileError> {
    let count = shards.first().map_or(0, |shard| shard.count);
    for index in 0..count {
        let found = shards.iter().filter(|shard| shard.index == index).count();
        if found != 1 {
            let how = if found == 0 { "missing" } else { "there more than once" };
            let reason = format!("is one of {count} shards, of which shard {}/{count} is {how}", index + 1);
            return Err(FileError::new(reason).at(name));
        }
    }
    Ok(())
}
