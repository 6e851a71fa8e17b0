//! A picture in progress, with its error.

use crate::executor::{HalflightExecutor, Scratch};
use crate::memory::{array, array_mut, bytes_of, place, shared, unique};
use crate::scene::HalflightScene;
use crate::settings::HalflightSettings;
use crate::status::{HalflightStatus, of};
use core::ffi::c_void;
use halflight_core::memory::Arena;
use halflight_core::{Method, Pixel, Renderer, Shard, Until};

/// Error of a picture: relMSE, the mean of squared errors over R² + 0.01 m² with m the mean radiance.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightError {
    /// Estimate.
    pub relmse: f64,
    /// Lower end of its 95 % interval.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

/// A picture in progress.
pub struct HalflightRenderer {
    renderer: Renderer<'static>,
    scratch: Scratch,
}

/// Bytes of a picture of `scene` and the `threads` of an executor; 0 of null, of a size that no picture has,
/// and of settings that do not exist.
///
/// # Safety
/// Pointers are null or of a scene and settings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_renderer_memory(
    scene: *const HalflightScene,
    settings: *const HalflightSettings,
    threads: usize,
) -> usize {
    // SAFETY: by the caller.
    let given = unsafe { (|| Ok((&shared(scene)?.scene, shared(settings)?.of_core()?)))() };
    let Ok::<_, HalflightStatus>((scene, settings)) = given else { return 0 };
    let memory = Renderer::required_memory(scene, &settings);
    bytes_of::<HalflightRenderer>(Scratch::footprint(memory, threads))
}

/// Builds the structures of a picture of `scene` in `bytes` bytes at `memory`, and chooses its method. The
/// picture is black. The scene must stay. `executor` may be null.
///
/// # Safety
/// Pointers are null or of a scene, settings and an executor; `memory` belongs to the renderer from now on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_renderer_new(
    scene: *const HalflightScene,
    settings: *const HalflightSettings,
    executor: *const HalflightExecutor,
    memory: *mut c_void,
    bytes: usize,
    renderer: *mut *mut HalflightRenderer,
) -> HalflightStatus {
    let make = |arena: &mut Arena<'static>| {
        // SAFETY: by the caller, in these two lines.
        let (scene, settings) = unsafe { (&shared(scene)?.scene, shared(settings)?.of_core()?) };
        let given = unsafe { HalflightExecutor::at(executor) };
        let each = Renderer::required_memory(scene, &settings).scratch;
        let mut scratch = Scratch::new(given.threads, each, arena)?;
        let renderer = Renderer::new(scene, &settings, arena, &mut scratch.executor(given))?;
        Ok(HalflightRenderer { renderer, scratch })
    };
    // SAFETY: by the caller. Settings that do not exist have no memory: they are the first mistake.
    of(unsafe {
        (|| {
            shared(settings)?.of_core()?;
            place((memory, bytes), renderer, make)
        })()
    })
}

/// Adds samples until each pixel has `samples`, or, where `error` is above 0, until the upper end of the
/// interval of the error is at most `error`, or bias keeps it out of reach. `executor` may be null.
///
/// # Safety
/// `renderer` is one that no one else uses; `executor` is null or an executor.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_renderer_step(
    renderer: *mut HalflightRenderer,
    executor: *const HalflightExecutor,
    samples: u32,
    error: f64,
) -> HalflightStatus {
    // SAFETY: by the caller.
    let (renderer, given) = unsafe { (unique(renderer), HalflightExecutor::at(executor)) };
    of(renderer.and_then(|HalflightRenderer { renderer, scratch }| {
        let until = if error > 0.0 { Until::Error(error) } else { Until::Samples(samples) };
        Ok(renderer.step(&mut scratch.executor(given), until)?)
    }))
}

/// Samples of the least sampled pixel; 0 of null.
///
/// # Safety
/// `renderer` is null or one that no one writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_renderer_samples(renderer: *const HalflightRenderer) -> u32 {
    // SAFETY: by the caller.
    unsafe { shared(renderer) }.map_or(0, |renderer| renderer.renderer.samples())
}

/// The method at work, `HALFLIGHT_PATH` and others; `HALFLIGHT_AUTO` of null.
///
/// # Safety
/// `renderer` is null or one that no one writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_renderer_method(renderer: *const HalflightRenderer) -> u32 {
    // SAFETY: by the caller.
    let kind = unsafe { shared(renderer) }.map(|renderer| renderer.renderer.method());
    let number =
        kind.ok().and_then(|kind| Method::all().iter().position(|method| method.kind() == Some(kind)));
    number.unwrap_or(0) as u32
}

/// Writes the error of the picture to `error`, and returns true; false below four samples per pixel and for a
/// black picture.
///
/// # Safety
/// `renderer` is null or one that no one writes; `error` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_renderer_error(
    renderer: *const HalflightRenderer,
    error: *mut HalflightError,
) -> bool {
    // SAFETY: by the caller.
    let both = unsafe { (|| Ok((shared(renderer)?, unique(error)?)))() };
    let Ok::<_, HalflightStatus>((renderer, to)) = both else { return false };
    let Some(error) = renderer.renderer.error() else { return false };
    *to = HalflightError { relmse: error.relmse, lower: error.lower, upper: error.upper };
    true
}

/// Writes the first `count` pixels of the picture, three floats of radiance each, row by row from the top.
/// A count above that of the picture is a mistake, and nothing is written.
///
/// # Safety
/// `renderer` is one that no one writes; `pixels` has `3 * count` floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_renderer_picture(
    renderer: *const HalflightRenderer,
    pixels: *mut f32,
    count: usize,
) -> HalflightStatus {
    // SAFETY: by the caller; arrays of floats have the alignment of their elements.
    let arrays = unsafe { (|| Ok((shared(renderer)?, array_mut(pixels.cast::<[f32; 3]>(), count)?)))() };
    of(arrays.and_then(|(renderer, pixels)| {
        let film = renderer.renderer.film();
        if pixels.len() as u64 > u64::from(film.width()) * u64::from(film.height()) {
            return Err(HalflightStatus::Setting);
        }
        for (to, light) in pixels.iter_mut().zip(renderer.renderer.picture()) {
            *to = light.to_array();
        }
        Ok(())
    }))
}

/// Bytes of the film of `renderer`, and their number: sums of the samples of each pixel, to be taken by
/// `halflight_renderer_take` of another renderer. They change with the next step. Null of null.
///
/// # Safety
/// `renderer` is null or one that no one writes; `bytes` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_renderer_film(
    renderer: *const HalflightRenderer,
    bytes: *mut usize,
) -> *const c_void {
    // SAFETY: by the caller.
    let both = unsafe { (|| Ok((shared(renderer)?, unique(bytes)?)))() };
    let Ok::<_, HalflightStatus>((renderer, bytes)) = both else { return core::ptr::null() };
    let pixels = renderer.renderer.film().pixels();
    *bytes = size_of_val(pixels);
    pixels.as_ptr().cast()
}

/// Replaces the tiles of shard `shard` of `shards` by those of another renderer of the same scene and
/// settings but for the shard: the `bytes` bytes of its `film`, and its number of `samples`. The next step
/// judges the error of the whole.
///
/// # Safety
/// `renderer` is one that no one else uses; `film` has `bytes` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_renderer_take(
    renderer: *mut HalflightRenderer,
    shard: u32,
    shards: u32,
    film: *const c_void,
    bytes: usize,
    samples: u32,
) -> HalflightStatus {
    // SAFETY: by the caller.
    let both =
        unsafe { (|| Ok((unique(renderer)?, array(film.cast::<Pixel>(), bytes / size_of::<Pixel>())?)))() };
    of(both.and_then(|(renderer, pixels)| {
        if shard >= shards || pixels.len() != renderer.renderer.film().pixels().len() {
            return Err(HalflightStatus::Setting);
        }
        renderer.renderer.take_tiles(Shard::part(shard, shards), pixels, samples);
        Ok(())
    }))
}
