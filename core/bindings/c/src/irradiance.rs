//! Irradiance at points of a scene, each with its interval.

use crate::executor::{HalflightExecutor, Scratch};
use crate::memory::{array, array_mut, bytes_of, place, shared, unique};
use crate::scene::HalflightScene;
use crate::settings::HalflightPointSettings;
use crate::status::{HalflightStatus, of};
use core::ffi::c_void;
use halflight_core::glam::Vec3;
use halflight_core::memory::{Arena, Footprint};
use halflight_core::{IrradiancePoint, IrradianceRenderer, LightProbe, PointIrradiance, Until};

/// A place with the unit normal of its hemisphere. Points within rounding of a surface are put on it.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightPoint {
    /// Position.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
}

/// Irradiance of a point.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightIrradiance {
    /// Irradiance, W/m².
    pub irradiance: [f32; 3],
    /// Lower end of the 95 % interval of its luminance.
    pub lower: f32,
    /// Upper end; infinite below two samples.
    pub upper: f32,
    /// Number of samples.
    pub samples: u32,
}

/// Irradiance of points in progress.
pub struct HalflightIrradianceRenderer {
    renderer: IrradianceRenderer<'static>,
    scratch: Scratch,
    count: usize,
}

/// Bytes for `count` points of `scene` and the `threads` of an executor; 0 of null and of no point.
///
/// # Safety
/// `scene` is null or a scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_irradiance_memory(
    scene: *const HalflightScene,
    count: usize,
    threads: usize,
) -> usize {
    // SAFETY: by the caller.
    let Ok(scene) = (unsafe { shared(scene) }) else { return 0 };
    if count == 0 {
        return 0;
    }
    let memory = IrradianceRenderer::required_memory(&scene.scene, count);
    let points = Footprint::default().slice::<IrradiancePoint>(count);
    bytes_of::<HalflightIrradianceRenderer>(points.and(Scratch::footprint(memory, threads)))
}

/// Prepares `count` points of `scene` in `bytes` bytes at `memory`. The scene must stay; `points` need not.
/// `settings` and `executor` may be null.
///
/// # Safety
/// Pointers are null or of arrays as large as they say; `memory` belongs to the renderer from now on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_irradiance_new(
    scene: *const HalflightScene,
    points: *const HalflightPoint,
    count: usize,
    settings: *const HalflightPointSettings,
    executor: *const HalflightExecutor,
    memory: *mut c_void,
    bytes: usize,
    renderer: *mut *mut HalflightIrradianceRenderer,
) -> HalflightStatus {
    let make = |arena: &mut Arena<'static>| {
        // SAFETY: by the caller, in these four lines.
        let (scene, points) = unsafe { (&shared(scene)?.scene, array(points, count)?) };
        let given = unsafe { HalflightExecutor::at(executor) };
        let settings = unsafe { settings.as_ref() };
        let settings = settings.map(HalflightPointSettings::of_core).transpose()?.unwrap_or_default();
        let free = arena.slice::<IrradiancePoint>(count)?;
        for (to, point) in free.iter_mut().zip(points) {
            *to =
                IrradiancePoint::free(point.position.into(), Vec3::from(point.normal).normalize_or(Vec3::Y));
        }
        let each = IrradianceRenderer::required_memory(scene, count).scratch;
        let mut scratch = Scratch::new(given.threads, each, arena)?;
        let renderer = IrradianceRenderer::new(scene, free, &settings, arena, &mut scratch.executor(given))?;
        Ok(HalflightIrradianceRenderer { renderer, scratch, count })
    };
    // SAFETY: by the caller.
    of(unsafe { place((memory, bytes), renderer, make) })
}

/// Adds samples until each point has `samples`, or, where `error` is above 0, until the intervals of nearly
/// all points are within the relative error: then 0 `samples` are no limit. `executor` may be null.
///
/// # Safety
/// `renderer` is one that no one else uses; `executor` is null or an executor.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_irradiance_step(
    renderer: *mut HalflightIrradianceRenderer,
    executor: *const HalflightExecutor,
    samples: u32,
    error: f64,
) -> HalflightStatus {
    // SAFETY: by the caller.
    let (renderer, given) = unsafe { (unique(renderer), HalflightExecutor::at(executor)) };
    of(renderer.and_then(|HalflightIrradianceRenderer { renderer, scratch, .. }| {
        let mut executor = scratch.executor(given);
        Ok(match (error > 0.0, samples) {
            (true, 0) => renderer.step(&mut executor, Until::Error(error)),
            (true, most) => renderer.step_within(&mut executor, error, most),
            (false, samples) => renderer.step(&mut executor, Until::Samples(samples)),
        }?)
    }))
}

/// Writes the irradiance of the first `count` points, in the order of the points. A count above theirs is a
/// mistake, and nothing is written.
///
/// # Safety
/// `renderer` is one that no one writes; `values` has `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_irradiance_values(
    renderer: *const HalflightIrradianceRenderer,
    values: *mut HalflightIrradiance,
    count: usize,
) -> HalflightStatus {
    // SAFETY: by the caller.
    let arrays = unsafe { (|| Ok((shared(renderer)?, array_mut(values, count)?)))() };
    of(arrays.and_then(|(renderer, values)| {
        if values.len() > renderer.count {
            return Err(HalflightStatus::Setting);
        }
        for (to, value) in values.iter_mut().zip(renderer.renderer.values()) {
            let irradiance = value.irradiance.to_array();
            let (lower, upper, samples) = (value.lower, value.upper, value.samples);
            *to = HalflightIrradiance { irradiance, lower, upper, samples };
        }
        Ok(())
    }))
}

/// Number of the normals of a light probe.
pub const HALFLIGHT_PROBE_NORMALS: usize = 24;

/// Light around a place: coefficients of spherical harmonics of radiance, in the order 1, y, z, x, xy, yz,
/// 3z^2 - 1, xz, x^2 - y^2.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightProbe {
    /// Coefficients, three floats each.
    pub coefficients: [[f32; 3]; 9],
    /// Half-widths of the 95 % intervals of their luminances.
    pub half_widths: [f32; 9],
}

/// Writes the normals of the `HALFLIGHT_PROBE_NORMALS` points of a probe, three floats each.
///
/// # Safety
/// `normals` has `3 * HALFLIGHT_PROBE_NORMALS` floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_probe_normals(normals: *mut f32) -> HalflightStatus {
    // SAFETY: by the caller; arrays of floats have the alignment of their elements.
    let normals = unsafe { array_mut(normals.cast::<[f32; 3]>(), HALFLIGHT_PROBE_NORMALS) };
    of(normals.map(|normals| {
        normals.iter_mut().zip(LightProbe::normals()).for_each(|(to, normal)| *to = normal.to_array());
    }))
}

/// Writes `count` probes from irradiances by their normals, `HALFLIGHT_PROBE_NORMALS` values for each.
///
/// # Safety
/// `values` has `count * HALFLIGHT_PROBE_NORMALS` elements that no one writes; `probes` has `count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_probes(
    values: *const HalflightIrradiance,
    count: usize,
    probes: *mut HalflightProbe,
) -> HalflightStatus {
    let number = count.saturating_mul(HALFLIGHT_PROBE_NORMALS);
    // SAFETY: by the caller.
    let arrays = unsafe { (|| Ok((array(values, number)?, array_mut(probes, count)?)))() };
    of(arrays.map(|(values, probes)| {
        for (to, values) in probes.iter_mut().zip(values.chunks_exact(HALFLIGHT_PROBE_NORMALS)) {
            let mut of_normals = [PointIrradiance::default(); HALFLIGHT_PROBE_NORMALS];
            for (to, value) in of_normals.iter_mut().zip(values) {
                let HalflightIrradiance { irradiance, lower, upper, samples } = *value;
                *to = PointIrradiance { irradiance: irradiance.into(), lower, upper, samples };
            }
            let LightProbe { coefficients, half_widths } = LightProbe::of(&of_normals);
            *to = HalflightProbe { coefficients: coefficients.map(|c| c.to_array()), half_widths };
        }
    }))
}
