//! Validity ellipse of a record: two radii from its derivatives, by an error metric.

use super::derivatives::{Derivatives, Hessian};
use super::metric::{Metric, Settings};
use core::f32::consts::PI;
use glam::Vec2;
use halflight_simd::kernels::eigen::{Eigen2, symmetric2};

/// Region in which a record may be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Validity {
    /// Unit direction of the shorter radius, in the tangent frame; the longer radius is perpendicular.
    pub axis: Vec2,
    /// Shorter and longer radius, m.
    pub radii: [f32; 2],
    /// Radii of the support over the radii of the region: 1, or more to average over more records.
    pub overlap: f32,
    /// Second derivatives along the axes for extrapolation, relative to the irradiance: at (x, y) along the
    /// axes it changes by (x² bend₀ + y² bend₁)/2. Zero if the metric extrapolates to first order.
    pub bend: [f32; 2],
    /// Factor of the gradients that keeps the extrapolated luminance between zero and twice the irradiance
    /// within the radii. 1 if the radii are the metric's own.
    pub gradient_scale: f32,
    /// Curvatures along the axes behind the radii: at (x, y) along the axes the expected relative error of
    /// extrapolation is (x² curvature₀ + y² curvature₁)/2. Zero if the metric has none.
    pub curvature: [f32; 2],
    /// Allowed error over the region, an integral over area, m²; the region shrinks if neighbours show a
    /// larger error. Zero if the metric does not compare neighbours.
    pub allowed: f32,
    /// Minimum radius, m.
    pub least: f32,
}

/// Overlap of [`Metric::Halflight`] in radii, if the noise of a record is unknown.
const OVERLAP: f32 = 1.5;

/// Region of a record with these derivatives, which should be those of [`Metric::derivatives`].
///
/// With [`Metric::Halflight`] a point outside the radii of all records gets a record, and a point is
/// interpolated from all records within [`OVERLAP`] times their radii: twice as many, whose independent
/// errors average out. To first order this would fail, since the error of extrapolation is quadratic in
/// distance; but the Hessian is known and included in the extrapolation.
pub fn validity(settings: &Settings, derivatives: &Derivatives) -> Validity {
    let (principal, radii) = wanted(settings, derivatives);
    region(settings, derivatives, principal, radii)
}

/// [`validity`] of a record that also supplies a lobe: with [`Metric::Halflight`] by the larger curvatures of
/// the irradiance and of the light `leaving` to the viewer, along the axes of the larger.
pub fn validity_with_lobe(settings: &Settings, derivatives: &Derivatives, leaving: &Derivatives) -> Validity {
    let (own, radii) = wanted(settings, derivatives);
    let (other, others) = wanted(settings, leaving);
    let is_narrower = settings.metric == Metric::Halflight && others[0] < radii[0];
    if !is_narrower {
        return region(settings, derivatives, own, radii);
    }
    let Hessian { xx, xy, yy } = derivatives.hessian;
    let signed = [other.axis, other.axis.perp()]
        .map(|axis| axis.x * (xx * axis.x + xy * axis.y) + axis.y * (xy * axis.x + yy * axis.y));
    let irradiance = derivatives.luminance();
    let curvature = [0, 1].map(|k: usize| other.curvature[k].max(signed[k].abs() / irradiance));
    let allowed = settings.error * settings.extent * settings.extent;
    let radii = [others[0], others[1].min(radius(allowed, curvature[1]))];
    region(settings, derivatives, PrincipalCurvatures { axis: other.axis, curvature, signed }, radii)
}

/// True if there is light to extrapolate.
fn is_lit(derivatives: &Derivatives) -> bool {
    let irradiance = derivatives.luminance();
    irradiance > 0.0 && irradiance.is_finite() && derivatives.luminance_gradient().length().is_finite()
}

/// Curvatures and radii that the metric wants, before its limits.
fn wanted(settings: &Settings, derivatives: &Derivatives) -> (PrincipalCurvatures, [f32; 2]) {
    let irradiance = derivatives.luminance();
    let slope = derivatives.luminance_gradient().length();
    // A black or invalid record has no meaningful gradient.
    let lit = is_lit(derivatives);
    let flat = if lit && slope > 0.0 { irradiance / slope } else { f32::INFINITY };
    let circle = |distance: f32| (PrincipalCurvatures::default(), [settings.error * distance; 2]);
    match settings.metric {
        Metric::SplitSphere => circle(derivatives.harmonic_mean_distance),
        Metric::BoundedSplitSphere => circle(derivatives.harmonic_mean_distance.min(flat)),
        Metric::MinDistance => circle(derivatives.min_distance),
        _ => {
            let principal = curvatures(settings, derivatives, lit);
            let allowed = settings.error * settings.extent * settings.extent;
            let [short, long] = principal.curvature.map(|l| radius(allowed, l));
            // The gradient may show what the Hessian cannot: a radiance edge behind an occluder's edge.
            let bound = if settings.metric == Metric::Halflight { flat } else { f32::INFINITY };
            (principal, [short.min(bound), long])
        }
    }
}

/// Region with `wanted` radii along the axes of `principal`.
fn region(
    settings: &Settings,
    derivatives: &Derivatives,
    principal: PrincipalCurvatures,
    wanted: [f32; 2],
) -> Validity {
    let (irradiance, lit) = (derivatives.luminance(), is_lit(derivatives));
    let PrincipalCurvatures { axis, curvature, signed } = principal;
    let radii = clamped(settings, wanted);
    // Radii enlarged to the minimum keep the change of light over the wanted radii: a pixel shows no more,
    // and derivatives due to such a near border say nothing about its other side.
    let shares =
        [0, 1].map(|k: usize| if wanted[k] < radii[k] { (wanted[k] / radii[k]).max(0.0) } else { 1.0 });
    // Extrapolation changes by |∇E · dx|, at most on the rim of the ellipse.
    let gradient = derivatives.luminance_gradient();
    let rise = Vec2::new(radii[0] * gradient.dot(axis), radii[1] * gradient.dot(axis.perp())).length();
    let gradient_scale = match lit {
        false => 0.0,
        true if rise > irradiance => shares[0].min(irradiance / rise),
        true => shares[0],
    };
    let second = lit && settings.metric == Metric::Halflight;
    let overlap = if settings.metric == Metric::Halflight { OVERLAP } else { 1.0 };
    let bend = [0, 1].map(|k| {
        // Radii may exceed those of the curvature: the second order changes the irradiance by at most itself.
        let most = 2.0 / (overlap * radii[k] * overlap * radii[k]);
        let bend = shares[k] * shares[k] * signed[k] / irradiance;
        if second && bend.is_finite() { bend.max(-most).min(most) } else { 0.0 }
    });
    let allowed = if second { settings.error * settings.extent * settings.extent } else { 0.0 };
    Validity { axis, radii, overlap, bend, gradient_scale, curvature, allowed, least: settings.least }
}

/// R = (4 ε/π|l|)^¼: radius at which a record of relative curvature `l` has the error `allowed`.
pub(super) fn radius(allowed: f32, l: f32) -> f32 {
    libm::sqrtf(libm::sqrtf(4.0 / PI * allowed / l))
}

/// Eigenvalues of a Hessian, and curvatures derived from them.
struct PrincipalCurvatures {
    /// Axis of the larger eigenvalue.
    axis: Vec2,
    /// Magnitudes relative to the irradiance, the larger first, by the rules of the metric.
    curvature: [f32; 2],
    /// Signed eigenvalues.
    signed: [f32; 2],
}

impl Default for PrincipalCurvatures {
    fn default() -> Self {
        Self { axis: Vec2::X, curvature: [0.0; 2], signed: [0.0; 2] }
    }
}

/// Relative curvatures of the irradiance along the axes, the larger first, from the Hessian by the rules of
/// the metric.
fn curvatures(settings: &Settings, derivatives: &Derivatives, lit: bool) -> PrincipalCurvatures {
    let irradiance = derivatives.luminance();
    let against = settings.against.unwrap_or(irradiance);
    match settings.metric {
        // Radiance 1 everywhere: irradiance π in any scene.
        Metric::GeometricHessian => relative(derivatives.hessian, PI),
        // Radiances raised by 1 % of E, or to 1 if all are black.
        Metric::OcclusionHessian if lit => {
            relative(derivatives.hessian + derivatives.open_hessian * (0.01 * irradiance), against)
        }
        Metric::OcclusionHessian => relative(derivatives.open_hessian, PI),
        Metric::Halflight => {
            let near = derivatives.mean_square_inverse_distance;
            let principal = relative(derivatives.hessian, against);
            let [large, small] = principal.curvature;
            let floor = settings.floor * near;
            match lit && large.is_finite() {
                true => PrincipalCurvatures { curvature: [large + floor, small + floor], ..principal },
                // The distances bound how fast light may come into sight.
                false => PrincipalCurvatures { curvature: [near; 2], ..PrincipalCurvatures::default() },
            }
        }
        _ => relative(derivatives.hessian, against),
    }
}

/// Axis and magnitudes of the eigenvalues of `hessian`/`irradiance`. A zero eigenvalue is zero relative to
/// any irradiance.
fn relative(hessian: Hessian, irradiance: f32) -> PrincipalCurvatures {
    let Eigen2 { values, axis } = symmetric2(|x| x, [hessian.xx, hessian.xy, hessian.yy]);
    let axis = Vec2::from(axis);
    let curvature = values.map(|l| if l == 0.0 { 0.0 } else { l.abs() / irradiance });
    PrincipalCurvatures { axis: if axis.is_finite() { axis } else { Vec2::X }, curvature, signed: values }
}

/// Radii within limits: the longer at most `aspect` times the shorter, then both from `least` to `most`; NaN
/// becomes `least`.
fn clamped(settings: &Settings, [short, long]: [f32; 2]) -> [f32; 2] {
    let short = if short.is_nan() { 0.0 } else { short };
    let long = long.max(short).min(settings.aspect.max(1.0) * short);
    [short, long].map(|radius| radius.min(settings.most).max(settings.least))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;

    /// Rounding of roots and products.
    const TOLERANCE: f32 = 1e-6;

    fn record(hessian: [f32; 3], gradient: Vec2) -> Derivatives {
        Derivatives {
            irradiance: Rgb::splat(2.0),
            gradient: [gradient; 3],
            rotation: [Vec2::ZERO; 3],
            hessian: Hessian { xx: hessian[0], xy: hessian[1], yy: hessian[2] },
            open_hessian: Hessian::default(),
            mean_square_inverse_distance: 0.25,
            harmonic_mean_distance: 3.0,
            min_distance: 0.5,
        }
    }

    fn settings(metric: Metric) -> Settings {
        Settings { error: 0.01, most: 100.0, ..Settings::new(metric, 2.0) }
    }

    #[track_caller]
    fn near(found: f32, wanted: f32) {
        assert!((found - wanted).abs() <= TOLERANCE * wanted.abs(), "{found} for {wanted}");
    }

    #[test]
    fn the_family_of_split_spheres_takes_distances() {
        let record = record([1.0; 3], Vec2::new(0.0, 1.0));
        let of = |metric| validity(&settings(metric), &record).radii;
        near(of(Metric::SplitSphere)[0], 0.03);
        // E/|∇E| = 2 is less than the mean distance of 3.
        near(of(Metric::BoundedSplitSphere)[1], 0.02);
        near(of(Metric::MinDistance)[0], 0.005);
    }

    /// λ = -4, 0.25 along x, y and E = 2: curvatures 2 and 1/8; ε = 0.01·2²; R = (4·0.04/π l)^¼.
    #[test]
    fn a_hessian_gives_the_ellipse_of_the_paper() {
        let record = record([-4.0, 0.0, 0.25], Vec2::ZERO);
        let found = validity(&settings(Metric::OcclusionHessian), &record);
        let radius = (0.16 / PI / 2.0f32).powf(0.25);
        near(found.radii[0], radius);
        near(found.radii[1], 2.0 * radius);
        assert_eq!(found.axis.abs(), Vec2::X);
        assert_eq!((found.curvature, found.gradient_scale), ([2.0, 0.125], 1.0));
        let wide = Settings { aspect: 1.5, ..settings(Metric::OcclusionHessian) };
        near(validity(&wide, &record).radii[1], 1.5 * radius);
        let circle = Settings { aspect: 0.0, ..wide };
        near(validity(&circle, &record).radii[1], radius);
        // Absolute error: against 8 the curvatures are a quarter, and the radii √2 longer.
        let absolute = Settings { against: Some(8.0), ..settings(Metric::OcclusionHessian) };
        near(validity(&absolute, &record).radii[0], core::f32::consts::SQRT_2 * radius);
    }

    /// The integral of ½|l₁x² + l₂y²| over a circle with both curvatures equal is the allowed error.
    #[test]
    fn the_error_over_the_reach_is_the_error_allowed() {
        let settings = settings(Metric::OcclusionHessian);
        let Validity { radii: [r, s], curvature, .. } =
            validity(&settings, &record([3.0, 0.0, 3.0], Vec2::ZERO));
        assert_eq!(r, s);
        let (mut integral, n) = (0.0f64, 1000);
        for i in 0..n * n {
            let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n) * 2.0 - 1.0;
            let (x, y) = (f64::from(r) * at(i % n), f64::from(s) * at(i / n));
            if x * x + y * y < f64::from(r * s) {
                let [l, m] = curvature.map(f64::from);
                integral += 0.5 * (l * x * x + m * y * y) * f64::from(2.0 * r) * f64::from(2.0 * s)
                    / f64::from(n * n);
            }
        }
        let allowed = f64::from(settings.error * settings.extent * settings.extent);
        // Area of a circle by a million points.
        assert!((integral / allowed - 1.0).abs() < 2e-3, "{integral} {allowed}");
    }

    #[test]
    fn halflight_has_a_floor_and_a_bound() {
        // Zero Hessian: 0.01 <u²> = 0.0025 replaces the curvature.
        let flat = validity(&settings(Metric::Halflight), &record([0.0; 3], Vec2::ZERO));
        let radius = (0.16 / PI / 0.0025f32).powf(0.25);
        near(flat.radii[0], radius);
        near(flat.radii[1], radius);
        assert_eq!((flat.overlap, flat.bend), (OVERLAP, [0.0; 2]));
        // A saddle is extrapolated by its curvatures: -4 and 0.25 over 2.
        let saddle = validity(&settings(Metric::Halflight), &record([0.25, 0.0, -4.0], Vec2::ZERO));
        assert_eq!((saddle.bend, saddle.axis.abs()), ([-2.0, 0.125], Vec2::Y));
        assert_eq!(
            validity(&settings(Metric::OcclusionHessian), &record([1.0; 3], Vec2::ZERO)).bend,
            [0.0; 2]
        );
        // A steep gradient: E/|∇E| = 0.5 is smaller.
        let steep = validity(&settings(Metric::Halflight), &record([0.0; 3], Vec2::new(0.0, 4.0)));
        near(steep.radii[0], 0.5);
        near(steep.radii[1], 1.0);
    }

    #[test]
    fn black_surroundings_fall_back_on_geometry() {
        let black = Derivatives {
            irradiance: Rgb::ZERO,
            open_hessian: Hessian { xx: PI, xy: 0.0, yy: PI },
            ..record([0.0; 3], Vec2::ZERO)
        };
        let radius = |l: f32| (0.16 / PI / l).powf(0.25);
        let found = validity(&settings(Metric::Halflight), &black);
        near(found.radii[0], radius(0.25));
        assert_eq!(found.gradient_scale, 0.0);
        near(validity(&settings(Metric::OcclusionHessian), &black).radii[0], radius(1.0));
        assert_eq!(validity(&settings(Metric::RadiometricHessian), &black).radii, [100.0; 2]);
    }

    /// Leaving light has the curvature 8 along y, irradiance 2 along x: the axes are those of the former, and
    /// the irradiance bends along them.
    #[test]
    fn leaving_light_narrows_the_region_and_irradiance_bends_in_it() {
        let settings = Settings { floor: 0.0, ..settings(Metric::Halflight) };
        let own = record([-4.0, 0.0, 0.25], Vec2::ZERO);
        let leaving = record([0.5, 0.0, 16.0], Vec2::ZERO);
        let found = validity_with_lobe(&settings, &own, &leaving);
        near(found.radii[0], (0.16 / PI / 8.0f32).powf(0.25));
        near(found.radii[1], (0.16 / PI / 2.0f32).powf(0.25));
        assert_eq!((found.axis.abs(), found.bend, found.curvature), (Vec2::Y, [0.125, -2.0], [8.0, 2.0]));
        let flat = Derivatives { hessian: Hessian::default(), ..leaving };
        assert_eq!(validity_with_lobe(&settings, &own, &flat), validity(&settings, &own));
        let unknown = Derivatives { hessian: Hessian { xx: f32::NAN, xy: 0.0, yy: 0.0 }, ..leaving };
        assert!(validity_with_lobe(&settings, &own, &unknown).radii[0] > 0.0);
    }

    #[test]
    fn radii_keep_their_limits_and_the_gradient_gives_way() {
        let steep = record([0.0; 3], Vec2::new(3.0, 4.0));
        let limited = Settings { least: 1.0, ..settings(Metric::Halflight) };
        let found = validity(&limited, &steep);
        near(found.radii[0], 1.0);
        near(found.radii[1], 1.0);
        // |∇E| R = 5 and E = 2.
        near(found.gradient_scale, 0.4);
        let limited = Settings { most: 0.1, ..settings(Metric::Halflight) };
        assert_eq!(validity(&limited, &steep).radii, [0.1; 2]);
    }

    #[test]
    fn nothing_is_undefined() {
        let numbers = [f32::NAN, f32::INFINITY, -1.0, 0.0, f32::MIN_POSITIVE, f32::MAX];
        for a in numbers {
            for b in numbers {
                let record = Derivatives {
                    irradiance: Rgb::splat(a),
                    mean_square_inverse_distance: b,
                    harmonic_mean_distance: b,
                    min_distance: a,
                    open_hessian: Hessian { xx: b, xy: a, yy: b },
                    ..record([b, a, b], Vec2::new(a, b))
                };
                for metric in Metric::ALL {
                    let settings = Settings { least: 0.125, ..settings(metric) };
                    let Validity { axis, radii: [short, long], gradient_scale, bend, .. } =
                        validity(&settings, &record);
                    let ordered = 0.125 <= short && short <= long && long <= 100.0;
                    assert!(ordered, "{metric:?} of {record:?}: {short} {long}");
                    assert!((0.0..=1.0).contains(&gradient_scale), "{metric:?} of {record:?}");
                    assert!(bend.iter().all(|bend| bend.is_finite()), "{metric:?} of {record:?}: {bend:?}");
                    assert!((axis.length() - 1.0).abs() < TOLERANCE, "{metric:?} of {record:?}: {axis}");
                }
            }
        }
    }

    /// A scene in other units: lengths times 1024, gradients and Hessians scaled accordingly.
    #[test]
    fn a_scene_of_another_size_has_radii_of_that_size() {
        const SIZE: f32 = 1024.0;
        let gradient = Vec2::new(0.5, -0.25);
        let (hessian, size) = ([2.0, 0.5, -1.0], SIZE);
        let here = record(hessian, gradient);
        let there = Derivatives {
            mean_square_inverse_distance: here.mean_square_inverse_distance / (size * size),
            harmonic_mean_distance: here.harmonic_mean_distance * size,
            min_distance: here.min_distance * size,
            ..record(hessian.map(|h| h / (size * size)), gradient / size)
        };
        for metric in Metric::ALL {
            let here = validity(&Settings::new(metric, 2.0), &here);
            let there = validity(&Settings::new(metric, 2.0 * size), &there);
            for (here, there) in here.radii.iter().zip(there.radii) {
                near(there, here * size);
            }
        }
    }
}
