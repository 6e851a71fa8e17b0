//! Film files: checkpoints of a render, and shards to merge. Format: docs/file-container.md.

use super::container::{self, Kind};
use super::film_header::FilmHeader;
use super::identity::Identity;
use crate::file_error::FileError;
use crate::render::MOST_PIXELS;
use crate::save::Patience;
use core::ops::Range;
use halflight_core::film::{Dropped, PIXELS_PER_TILE, TILE, Tile};
use halflight_core::method::{RenderState, Shard};
use halflight_core::reconstruction::PixelSurfaces;
use halflight_core::transport::Counters;
use std::io;
use std::path::Path;

const KIND: Kind = Kind { magic: *b"HLFILM", version: 10, name: "film" };

/// Writes the film of `state` and the surfaces that its pixels see, if the header has them, to `path`,
/// completely or not at all.
pub(in crate::render) fn write(
    path: &Path,
    header: &FilmHeader,
    (state, surfaces): (&RenderState, Option<&[PixelSurfaces]>),
    patience: Patience,
) -> Result<(), FileError> {
    container::write(path, &KIND, header, patience, |file| {
        put_state(file, state, |file, task| match surfaces {
            Some(surfaces) => {
                let of_tile: Vec<_> =
                    rows(header.size(), task).flat_map(|row| &surfaces[row]).copied().collect();
                file.put(bytemuck::cast_slice(&of_tile))
            }
            None => Ok(()),
        })
    })
}

/// Writes counters, rejected samples and tiles with samples, each with what `beside` adds to it.
pub(super) fn put_state(
    file: &mut container::Writer,
    state: &RenderState,
    mut beside: impl FnMut(&mut container::Writer, usize) -> io::Result<()>,
) -> io::Result<()> {
    file.put(bytemuck::bytes_of(&state.counters))?;
    file.put_list(state.dropped)?;
    file.put_list(state.samples)?;
    let tiles = state.film.pixels().chunks(PIXELS_PER_TILE).enumerate();
    for (task, pixels) in tiles.filter(|(task, _)| state.samples[*task] > 0) {
        file.put(bytemuck::cast_slice(pixels))?;
        beside(file, task)?;
    }
    Ok(())
}

/// Adds what [`put_state`] has written of `shard` to `state`, a film of the same size; `beside` reads what
/// belongs to a tile beside its pixels.
pub(super) fn get_state(
    file: &mut container::Reader,
    shard: Shard,
    state: &mut RenderState,
    mut beside: impl FnMut(&mut container::Reader, usize) -> Result<(), FileError>,
) -> Result<(), FileError> {
    let tiles = state.samples.len();
    let mut counters = Counters::default();
    file.get(bytemuck::bytes_of_mut(&mut counters))?;
    let dropped: Vec<Dropped> = file.get_list(tiles)?;
    let taken: Vec<u32> = file.get_list(tiles)?;
    for (task, pixels) in state.film.pixels_mut().chunks_mut(PIXELS_PER_TILE).enumerate() {
        if taken[task] == 0 {
            continue;
        }
        if !shard.owns(task) {
            return Err(file.damage("it has tiles of other shards"));
        }
        file.get(bytemuck::cast_slice_mut(pixels))?;
        beside(file, task)?;
        state.samples[task] = taken[task];
    }
    state.counters += counters;
    state.dropped.iter_mut().zip(dropped).for_each(|(sum, dropped)| *sum += dropped);
    Ok(())
}

/// Pixels of a tile in a picture that is stored row by row.
fn rows([width, height]: [u32; 2], task: usize) -> impl Iterator<Item = Range<usize>> {
    let [x, y] = Tile::new(width, height, task).corner();
    let columns = x as usize..(x + TILE).min(width) as usize;
    (y..(y + TILE).min(height)).map(move |y| {
        let row = y as usize * width as usize;
        row + columns.start..row + columns.end
    })
}

/// A film file after its header was read.
pub(in crate::render) struct Reader {
    file: container::Reader<'static>,
    pub(in crate::render) header: FilmHeader,
}

impl Reader {
    /// Opens `path` and reads its header, within `most` bytes.
    pub(in crate::render) fn open(path: &Path, most: usize) -> Result<Self, FileError> {
        let (file, header): (_, FilmHeader) = container::Reader::open(path, &KIND, most)?;
        let Shard { index, count, .. } = header.shard();
        let [width, height] = header.size();
        if index >= count || !(1..=MOST_PIXELS).contains(&(u64::from(width) * u64::from(height))) {
            return Err(file.damage("there is no such picture"));
        }
        let each = size_of::<Dropped>() + size_of::<u32>();
        file.expect((Tile::count(width, height) * each) as u64, 1)?;
        Ok(Self { file, header })
    }

    /// Refuses a film of another identity or shard.
    pub(in crate::render) fn check(&self, identity: &Identity, shard: Shard) -> Result<(), FileError> {
        let own = (&self.header.identity, self.header.shard());
        let difference = Identity::difference_of_shards(own, (identity, shard));
        difference.map_or(Ok(()), |difference| Err(self.file.refusal(format!("is a film {difference}"))))
    }

    /// Refuses a film that cannot be merged with `first`.
    pub(in crate::render) fn check_sibling(&self, first: &Self) -> Result<(), FileError> {
        let of = |film: &Self| (film.header.shard().count, film.header.spp);
        let others = (&first.header.identity, of(first), first.file.path());
        let difference = self.header.identity.difference_of_siblings("film", of(self), others);
        difference.map_or(Ok(()), |difference| Err(self.file.refusal(difference)))
    }

    /// Reads the stored tiles into `state`, a film of the same size, and their `surfaces` into a picture.
    pub(in crate::render) fn read_into(
        mut self,
        state: &mut RenderState,
        mut surfaces: Option<&mut [PixelSurfaces]>,
    ) -> Result<(), FileError> {
        let [width, height] = self.header.size();
        let tiles = Tile::count(width, height);
        if tiles != state.samples.len() {
            return Err(self.file.damage("it has another size than it says"));
        }
        let has_surfaces = self.header.has_surfaces;
        get_state(&mut self.file, self.header.shard(), state, |file, task| {
            if !has_surfaces {
                return Ok(());
            }
            let count = rows([width, height], task).map(|row| row.len()).sum();
            let mut of_tile = vec![PixelSurfaces::default(); count];
            file.get(bytemuck::cast_slice_mut(&mut of_tile))?;
            if !of_tile.iter().all(PixelSurfaces::is_finite) {
                return Err(file.damage("it has surfaces that are not numbers"));
            }
            if let Some(surfaces) = &mut surfaces {
                let places = rows([width, height], task).flatten();
                places.zip(of_tile).for_each(|(place, found)| surfaces[place] = found);
            }
            Ok(())
        })?;
        self.file.finish()
    }
}
