//! Merging of the shards of a picture, with the bits of a single render.

use super::error::RenderError;
use super::files::{FilmHeader, FilmReader};
use super::image::Pictures;
use super::layers::{self, Layer, LayerSettings, Layers};
use super::merge_points::check_complete;
use super::rejected_tiles::{self, RejectedTile, empty_pixels};
use super::threads::{Pool, Threads, Workers};
use super::{Audited, ErrorEstimate, Method, NoiseAndBlur};
use crate::memory::{Budget, lines};
use crate::save::Image;
use halflight_core::audit::{AuditedPixels, ErrorReport};
use halflight_core::findings::Findings;
use halflight_core::memory::Arena;
use halflight_core::method::{RenderState, Shard};
use halflight_core::reconstruction::{FilmReconstruction, PixelLayers, PixelSurfaces};
use halflight_core::transport::Counters;
use std::path::PathBuf;

/// A merged picture with its statistics.
#[derive(Clone, Debug)]
pub struct Merged {
    /// The picture.
    pub image: Image,
    /// Estimated variance of each pixel and channel of the picture.
    pub variance: Image,
    /// Samples of each pixel, row by row.
    pub samples: Vec<u32>,
    /// Layers of samples and, if all films have them, albedo and normal of surfaces.
    pub layers: Layers,
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds of rendering, summed over all shards.
    pub seconds: f64,
    /// Paths, rays and rejected samples.
    pub counters: Counters,
    /// Tiles with rejected samples, most first.
    pub rejected_tiles: Vec<RejectedTile>,
    /// Black pixels, whose samples were all rejected.
    pub empty_pixels: u64,
    /// True if the method is biased, for instance by photon blur. An unmeasured bias is not in the error.
    pub is_biased: bool,
    /// Error from the two half-films, including bias if all shards were audited.
    pub error: Option<ErrorEstimate>,
    /// Noise and photon blur, if there are photons and no audit.
    pub noise_and_blur: Option<NoiseAndBlur>,
    /// Merged result of the shards' audits.
    pub audit: Option<Audited>,
    /// Numbers of the reconstruction, if the films have the surfaces that pixels see.
    pub findings: Findings,
}

/// Merges the films in `files`, in any order.
///
/// # Errors
/// Names the first file that does not belong to the first one and why, or missing and repeated shards.
pub fn merge(files: &[PathBuf]) -> Result<Merged, RenderError> {
    merge_with(files, &[])
}

/// As [`merge`], with these layers. Those that need the scene have no values.
///
/// # Errors
/// As [`merge`].
pub fn merge_with(files: &[PathBuf], layers: &[Layer]) -> Result<Merged, RenderError> {
    let most = Budget::new(None).limit();
    let films = files.iter().map(|file| FilmReader::open(file, most)).collect::<Result<Vec<_>, _>>()?;
    let (Some(first), Some(name)) = (films.first(), files.first()) else { return Err(RenderError::Shard) };
    films.iter().try_for_each(|film| film.check_sibling(first))?;
    let shards: Vec<Shard> = films.iter().map(|film| film.header.shard()).collect();
    check_complete(&shards, name)?;
    let [width, height] = first.header.size();
    let spp = first.header.spp;
    let is_biased = first.header.method().is_some_and(Method::is_biased);
    let is_shared = first.header.method().is_some_and(Method::has_common_errors);
    let is_reconstructed = films.iter().all(|film| film.header.has_surfaces);
    let pixels = width as usize * height as usize;
    let mut footprint = RenderState::footprint(width, height);
    if is_reconstructed {
        let made = FilmReconstruction::footprint([width, height]);
        footprint = footprint.slice::<PixelSurfaces>(pixels).and(made);
    }
    // The picture, its variance and samples, and the data of its error estimate.
    let wanted = LayerSettings { layers: layers.to_vec(), objects: Vec::new() };
    let of_layers = layers::footprint(&wanted, pixels).bytes();
    let needed = footprint.bytes().saturating_add(80 * pixels).saturating_add(of_layers);
    if needed > most {
        return Err(RenderError::Memory { needed, available: most });
    }
    let mut lines = lines(footprint)?;
    let mut arena = Arena::over(&mut lines);
    let mut state = RenderState::new(width, height, Shard::WHOLE, &mut arena)?;
    state.is_correlated = first.header.is_correlated;
    let surfaces: &mut [PixelSurfaces] = arena.slice(if is_reconstructed { pixels } else { 0 })?;
    let headers: Vec<FilmHeader> = films.iter().map(|film| film.header.clone()).collect();
    let seconds = headers.iter().map(|header| header.seconds).sum();
    for film in films {
        film.read_into(&mut state, is_reconstructed.then_some(&mut *surfaces))?;
    }
    let new = |surfaces| FilmReconstruction::new([width, height], surfaces, &mut arena);
    let reconstruction = is_reconstructed.then_some(&*surfaces).map(new).transpose()?;
    let mut reconstruction = reconstruction.map(|made| made.shared(is_shared));
    let audits = headers.iter().map(|header| Some((header.shard(), header.audit()?)));
    let audits: Option<Vec<_>> = audits.collect();
    let pixels = audits.iter().flatten().map(|(_, audit)| audit.pixels.len()).sum();
    let mut audited = crate::memory::lines(AuditedPixels::merged_footprint(pixels))?;
    let pool = Pool::new(None)?;
    let report = Workers::new(&pool).estimating(|executor| {
        let film = &state.film;
        let judge = |mean, noise, made: Option<&FilmReconstruction>, executor: &mut Threads| {
            let merged = AuditedPixels::merged(&audits?, film, mean, &mut Arena::over(&mut audited));
            // The memory is of the stated size.
            let mut merged = merged.ok()??;
            merged.compare(film, made, mean, executor);
            merged.verdict(noise)
        };
        ErrorReport::judged_by(&state, reconstruction.as_mut(), judge, executor)
    });
    let pictures = || Pictures::of(&state.film, reconstruction.as_ref(), wanted.has(Layer::Halves));
    let Pictures { image, variance, samples, layers: mut made } = Workers::new(&pool).install(pictures);
    if [Layer::Albedo, Layer::Normal].iter().any(|layer| wanted.has(*layer)) {
        let of_film = |surfaces: &PixelSurfaces| {
            let PixelSurfaces { albedo, normal, .. } = *surfaces;
            PixelLayers { albedo, normal, ..PixelLayers::default() }
        };
        made.surfaces = surfaces.iter().map(of_film).collect();
    }
    Ok(Merged {
        image,
        variance,
        samples,
        layers: made,
        spp,
        seconds,
        counters: state.counters,
        rejected_tiles: rejected_tiles::rejected_tiles(state.dropped, width, height),
        empty_pixels: empty_pixels(&state.film, |_| true),
        error: report.error(),
        noise_and_blur: report.noise_and_blur,
        audit: report.audited,
        findings: Findings::default().and(reconstruction.as_ref().map(FilmReconstruction::finding)),
        is_biased,
    })
}
