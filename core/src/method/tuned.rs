//! Measured numbers by which a method is chosen, each with its measurement. Pages are those of
//! `docs/decisions` and `docs/benchmarks`.

// Work, in rays of paths.

/// Rays per second and thread in a scene of few triangles (choice-of-method.md, budget).
pub(super) const RAYS_PER_SECOND: f64 = 6e6;

/// Triangles from which on detail costs work, and doublings of their number that add the work of a scene with
/// few. By seconds of 24 scenes of 36 to 383,000 triangles, within a third.
pub(super) const FEW_TRIANGLES: f64 = 4096.0;
pub(super) const DOUBLINGS_OF_WORK: f64 = 3.0;

/// Rays of a sample of a pixel before a trial has counted them: 4 to 12 in published scenes.
pub(super) const RAYS_PER_SAMPLE: f64 = 8.0;

/// A shadow ray with the BSDF at its start; a connection, which has two; a ray of a light path, whose vertex
/// is stored; the same in a photon map with the queries; and MIS with light paths, a factor on the work of
/// camera paths. Measured in a Cornell box and on veach-bidir.
pub(super) const SHADOW_RAY: f32 = 0.5;
pub(super) const CONNECTION: f32 = 0.6;
pub(super) const LIGHT_RAY: f32 = 0.8;
pub(super) const PHOTON: f32 = 0.7;
pub(super) const LIGHT_PATH_WEIGHTS: f32 = 1.15;

/// A path that gathers photons, relative to one that does not, for the same rays (caustic-photon-use.md).
pub(super) const GATHERING: f64 = 1.45;

/// A ray of filling of a cache, and the part of it that does not grow with detail. Within a third on 22 of 24
/// scenes.
pub(super) const GATHER_RAY: f64 = 0.8;
pub(super) const GATHER_RAY_OF_FEW: f64 = 1.5;

/// Rays of filling for each pixel of a picture of one pixel by the coarsest cache; they fall with this power
/// of the pixels. On 17 scenes at 576 and 4096 pixels within a factor of two.
pub(super) const FILLING_RAYS: f64 = 8550.0;
pub(super) const FILLING_POWER: f64 = 0.4;

/// Filling with records of lobes, relative to that without (choice-of-method.md).
pub(super) const FILLING_OF_LOBES: f64 = 1.5;

/// A ray of cached paths in a scene of few triangles with its share of look-ups. It is below one because
/// noise of light samples falls faster than with the inverse of their number.
pub(super) const CACHED_RAY: f64 = 0.8;

// Errors.

/// Least ratio of predicted errors, or of noise × work, for which another method takes the place of path
/// tracing: predictions are noisy (choice-of-method.md, regret).
pub(super) const LEAST_GAIN: f64 = 1.15;

/// The same for records of lobes in the place of an irradiance cache: they take more rays.
pub(super) const LEAST_GAIN_OF_LOBES: f64 = 1.1;

/// Gain of path reuse at most, that of the ablation: its own pilot misses rare light, which reuse does not
/// help, and promises up to 10 (ablation.md).
pub(super) const REUSE_GAIN: f64 = 2.5;

/// Factor on the predicted error of light paths: their rays take more time (choice-of-method.md).
pub(super) const LIGHT_PATHS_ERROR: f64 = 2.0;

/// The same for progressive photon mapping: a counted ray takes 1.2 to 2.3 times that of a path on four
/// scenes (choice-of-method.md).
pub(super) const PROGRESSIVE_ERROR: f64 = 2.0;

/// Factor on the predicted errors of paths and caches with caustic photons: light paths, density estimates,
/// and noise that sixteen samples of a block do not show. Geometric mean of 34 rows (choice-of-method.md).
pub(super) const PHOTONS_ERROR: f64 = 4.0;

/// Factors by which a reconstruction divides the noise of samples, and that of samples beside records and
/// caustic photons, for half of which there is time (choice-of-method.md, reconstructed pictures).
pub(super) const GAIN_OF_SAMPLES: f64 = 4.0;
pub(super) const GAIN_BESIDE_PHOTONS: f64 = 2.0;

/// relMSE of interpolation without noise by the coarsest cache; it falls with the allowed error. And gather
/// rays whose mean a pixel sees, for each of a record: look-ups interpolate, and gather rays end in records
/// (cache-time.md).
pub(super) const CACHE_BIAS: f64 = 1e-4;
pub(super) const RECORDS_OF_PIXEL: f64 = 20.0;

/// Times that the paths of a picture find light, at least, for it to be noise. Light that is found less often
/// is missing (choice-of-method.md, rare light).
pub(super) const LEAST_HITS: f64 = 4.0;

/// Least variance relative to the second moment in a pilot of counts, whose estimate of it is noisy.
pub(super) const LEAST_VARIANCE: f32 = 0.05;

// Sizes of pilots.

/// Rays of all pilots of usual size, their greatest fraction of the work, and their least size (pilots.md,
/// size).
pub(super) const PILOT_RAYS: f64 = 6e6;
pub(super) const PILOT_SHARE: f64 = 0.05;
pub(super) const LEAST_PILOT: f64 = 0.25;

/// Fewest samples of a pixel for which pilots gain more than they cost.
pub(super) const SAMPLES_OF_PILOTS: f64 = 4.0;

/// Rays of a trial, and its greatest fraction of the work.
pub(super) const TRIAL_RAYS: f64 = 2.5e5;
pub(super) const TRIAL_SHARE: f64 = 0.25;

/// Rays of the pilot of counts, and its greatest fraction of the work. And rays of one of its pixels, the
/// fraction of the work that its pixels may take where it is larger, and their least number (pilots.md).
pub(super) const COUNTS_RAYS: f64 = 5e5;
pub(super) const COUNTS_SHARE: f64 = 0.08;
pub(super) const COUNTS_RAYS_OF_PIXEL: f64 = 300.0;
pub(super) const COUNTS_SHARE_OF_PIXELS: f64 = 0.02;
pub(super) const COUNTS_FEWEST_PIXELS: f64 = 512.0;

/// Greatest fraction of the work for filling the coarsest cache, whose radii grow beyond it, and for a finer
/// one: a cache that is cut has more error than a coarser one (cache-time.md).
pub(super) const FILLING: f64 = 0.33;
pub(super) const FINER_FILLING: f64 = 0.3;

// Caustic photons (caustic-photon-use.md).

/// Least fraction of the picture's light for which photons pay, of light that path tracing finds badly; and
/// the part of it from which on a first test is undecided. The test finds a half to twice the share, and a
/// tenth of the visible paths as long as it has not learned which of many lights matter.
pub(super) const PHOTON_SHARE: f64 = 3.5e-2;
pub(super) const PHOTON_DOUBT: f64 = 0.25;

/// Share of the light in caustics from which on photons of path tracing find what splats and merges find: it
/// is 0.28 to 0.97 in caustic scenes, 0.08 on veach-bidir, where light paths find more than caustics.
pub(super) const CAUSTIC_LIGHT: f64 = 0.15;

/// Least relative variance of their light by path tracing alone, over that of all other light and over that
/// of the photons, for which photons pay as well; and the least fraction of light paths that the camera sees.
pub(super) const PHOTON_NOISE: f64 = 0.5;
pub(super) const PHOTON_GAIN: f64 = 2.0;
pub(super) const PHOTONS_VISIBLE: f64 = 0.0125;

/// Fraction of the picture's light from which on photons stay because path tracing never finds it, which no
/// pilot sees; and of light that it finds with no number of samples. Less is below the rounding of pictures.
pub(super) const MISSING_LIGHT: f64 = 5e-3;
pub(super) const HIDDEN_LIGHT: f64 = 1e-6;
