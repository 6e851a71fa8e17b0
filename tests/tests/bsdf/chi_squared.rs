//! Pearson's chi-squared test of `sample` against the density of `evaluate`, for every BSDF and view. Bins
//! surround the peak of the lobe and are logarithmic in the angle from it: a lobe of alpha 1e-4 fills as many
//! bins as a lobe of alpha 1. Delta samples and absorbed samples share one bin, which expects 1 minus the
//! integral of the density.

use super::cases::{VIEWS, draw, scattering, view};
use core::f64::consts::{SQRT_2, TAU};
use glam::{DVec3, Vec3};
use halflight_core::bsdf::{All, Bsdf};
use halflight_core::sampling::Random;

/// Significance of all tests together (Šidák): one false alarm in a hundred seeds. The seed is fixed.
const SIGNIFICANCE: f64 = 0.01;
const SAMPLES: u32 = 200_000;
const RINGS: usize = 40;
const SECTORS: usize = 24;
/// Cosines of the viewer. Nearer to the horizon the quadrature of bins fails before the density does.
const CHI_VIEWS: [f32; 4] = [1.0, 0.8, 0.4, 0.1];
/// Points per bin and axis of the integral of the density.
const SUBDIVISION: usize = 12;
/// Bins that expect fewer are pooled.
const LEAST_EXPECTED: f64 = 10.0;

/// Peaks of the lobe: the mirror direction, and for glass the refracted direction.
fn peaks(bsdf: &Bsdf, wo: Vec3) -> Vec<Rings> {
    let wo = wo.as_dvec3();
    let mut peaks = vec![Rings::new(DVec3::new(-wo.x, -wo.y, wo.z), width(bsdf))];
    if let Bsdf::RoughDielectric(b) = bsdf {
        let eta = f64::from(b.eta);
        let c2 = 1.0 - (1.0 - wo.z * wo.z) / (eta * eta);
        // Total reflection: the axis lies in the surface.
        let axis = DVec3::new(-wo.x / eta, -wo.y / eta, -c2.max(0.0).sqrt()).normalize();
        peaks.push(Rings::new(axis, width(bsdf) * (eta - 1.0).abs()));
    }
    peaks
}

/// Logarithmic polar bins around an axis: x = 1 - cos of the angle, from 0 to 2.
struct Rings {
    axis: DVec3,
    tangent: DVec3,
    bitangent: DVec3,
    /// x up to which the bins are linear.
    core: f64,
}

impl Rings {
    fn new(axis: DVec3, width: f64) -> Self {
        let (tangent, bitangent) = axis.any_orthonormal_pair();
        Self { axis, tangent, bitangent, core: 0.1 * width * width }
    }

    fn span(&self) -> f64 {
        (1.0 + 2.0 / self.core).ln()
    }

    fn bin(&self, d: DVec3) -> usize {
        let x = 0.5 * (d - self.axis).length_squared();
        let ring = ((1.0 + x / self.core).ln() / self.span() * RINGS as f64) as usize;
        let turn = d.dot(self.bitangent).atan2(d.dot(self.tangent)) / TAU;
        let sector = ((turn + 1.0).fract() * SECTORS as f64) as usize;
        ring.min(RINGS - 1) * SECTORS + sector.min(SECTORS - 1)
    }

    /// Direction at fractions of rings and sectors, and the solid angle per unit of both.
    fn direction(&self, ring: f64, turn: f64) -> (DVec3, f64) {
        let x = (self.core * ((ring * self.span()).exp() - 1.0)).min(2.0);
        let radius = (x * (2.0 - x)).max(0.0).sqrt();
        let (sin, cos) = (turn * TAU).sin_cos();
        let d = self.axis + radius * (cos * self.tangent + sin * self.bitangent) - x * self.axis;
        (d, (self.core + x) * self.span() * TAU)
    }
}

/// Bins of both half-spaces: around the mirror direction above, around the refracted one below.
struct Sphere {
    rings: Vec<Rings>,
}

impl Sphere {
    fn bin(&self, d: Vec3) -> usize {
        let side = usize::from(d.z < 0.0 && self.rings.len() > 1);
        side * RINGS * SECTORS + self.rings[side].bin(d.as_dvec3())
    }

    /// Expected probability of each bin, and the integral of f |cos|.
    fn integrate(&self, bsdf: &Bsdf, wo: Vec3) -> (Vec<f64>, DVec3) {
        let mut expected = Vec::with_capacity(self.rings.len() * RINGS * SECTORS);
        let mut value = DVec3::ZERO;
        for (side, rings) in self.rings.iter().enumerate() {
            for bin in 0..RINGS * SECTORS {
                let (ring, sector) = (bin / SECTORS, bin % SECTORS);
                let mut sum = 0.0;
                for sub in 0..SUBDIVISION * SUBDIVISION {
                    let at = |bin: usize, sub: usize, bins: usize| {
                        (bin as f64 + (sub as f64 + 0.5) / SUBDIVISION as f64) / bins as f64
                    };
                    let (d, solid_angle) = rings.direction(
                        at(ring, sub / SUBDIVISION, RINGS),
                        at(sector, sub % SUBDIVISION, SECTORS),
                    );
                    if self.rings.len() > 1 && (d.z < 0.0) != (side == 1) {
                        continue;
                    }
                    let (f, pdf) = bsdf.evaluate::<All>(wo, d.as_vec3());
                    sum += f64::from(pdf) * solid_angle;
                    value += f.as_dvec3() * solid_angle;
                }
                expected.push(sum);
            }
        }
        let cells = (RINGS * SECTORS * SUBDIVISION * SUBDIVISION) as f64;
        (expected.into_iter().map(|sum| sum / cells).collect(), value / cells)
    }
}

/// Probability that chi-squared of `k` degrees is at least `x`: Wilson and Hilferty's cube root is normal to
/// 1e-3 for the hundreds of degrees here.
fn survival(x: f64, k: f64) -> f64 {
    let z = ((x / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt();
    0.5 * erfc(z / SQRT_2)
}

/// Complementary error function (Numerical Recipes, erfcc: relative error below 1.2e-7).
fn erfc(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.5 * x.abs());
    let c = [
        -1.26551223,
        1.00002368,
        0.37409196,
        0.09678418,
        -0.18628806,
        0.27886807,
        -1.13520398,
        1.48851587,
        -0.82215223,
        0.17087277,
    ];
    let polynomial = c.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let tail = t * (-x * x + polynomial).exp();
    if x >= 0.0 { tail } else { 2.0 - tail }
}

#[test]
fn samples_follow_the_density_and_weights_the_value() {
    let cases = scattering();
    let tests = cases.len() * CHI_VIEWS.len();
    let alpha = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / tests as f64);
    let mut failures = Vec::new();
    for (stream, (name, bsdf)) in cases.iter().enumerate() {
        for (seed, cosine) in CHI_VIEWS.into_iter().enumerate() {
            let wo = view(cosine);
            let random = Random::new(seed as u32, stream as u32);
            let sphere = Sphere { rings: peaks(bsdf, wo) };
            let (expected, integral) = sphere.integrate(bsdf, wo);
            let mut seen = vec![0.0; expected.len()];
            let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
            for i in 0..SAMPLES {
                let Some(s) = draw(bsdf, wo, &random, i) else { continue };
                if s.delta {
                    continue;
                }
                seen[sphere.bin(s.direction)] += 1.0;
                sum += s.weight.as_dvec3();
                squares += s.weight.as_dvec3() * s.weight.as_dvec3();
            }
            let n = f64::from(SAMPLES);
            let (mut chi2, mut degrees, mut pool_seen, mut pool_expected) = (0.0, 0.0, 0.0, 0.0);
            for (&seen, &p) in seen.iter().zip(&expected) {
                if p * n < LEAST_EXPECTED {
                    pool_seen += seen;
                    pool_expected += p * n;
                } else {
                    chi2 += (seen - p * n).powi(2) / (p * n);
                    degrees += 1.0;
                }
            }
            let (total_seen, total): (f64, f64) = (seen.iter().sum(), expected.iter().sum());
            if total > 1.0 + 2e-3 {
                failures.push(format!("{name} from {cosine}: density integrates to {total}"));
            }
            for (seen, expected) in [(pool_seen, pool_expected), (n - total_seen, n * (1.0 - total))] {
                if expected >= LEAST_EXPECTED {
                    chi2 += (seen - expected).powi(2) / expected;
                    degrees += 1.0;
                } else if seen > LEAST_EXPECTED + 30.0 {
                    failures.push(format!("{name} from {cosine}: {seen} samples where {expected} were due"));
                }
            }
            let p = survival(chi2, degrees - 1.0);
            if p < alpha {
                failures.push(format!(
                    "{name} from {cosine}: chi2 {chi2:.0} of {degrees}, p = {p:.1e}; mass {total} seen {}",
                    total_seen / n
                ));
            }
            // Integral by samples: five standard deviations for three channels and all cases, plus the error
            // of quadrature.
            let mean = sum / n;
            let deviation = ((squares / n - mean * mean).max(DVec3::ZERO) / n).map(f64::sqrt);
            let allowed = 5.0 * deviation + DVec3::splat(2e-3) * integral;
            if (mean - integral).abs().cmpgt(allowed).any() {
                failures.push(format!("{name} from {cosine}: mean weight {mean}, integral {integral}"));
            }
        }
    }
    assert!(failures.is_empty(), "{} of {tests}:\n{}", failures.len(), failures.join("\n"));
}

/// Alpha of the narrow lobe, 1 without one.
fn width(bsdf: &Bsdf) -> f64 {
    let alpha = f64::from(match bsdf {
        Bsdf::Conductor(b) => b.alpha,
        Bsdf::RoughDielectric(b) => b.alpha,
        Bsdf::Glossy(b) => b.alpha(),
        Bsdf::Plastic(b) => b.alpha(),
        _ => 1.0,
    });
    if alpha > 0.0 { alpha } else { 1.0 }
}

#[test]
fn samples_carry_what_evaluate_says() {
    for (stream, (name, bsdf)) in scattering().iter().enumerate() {
        for cosine in VIEWS {
            let (wo, random) = (view(cosine), Random::new(99, stream as u32));
            for i in 0..2000 {
                let Some(s) = draw(bsdf, wo, &random, i) else { continue };
                assert!((s.direction.length() - 1.0).abs() < 1e-5, "{name}");
                assert_eq!(s.transmitted, s.direction.z < 0.0, "{name}");
                if s.delta {
                    continue;
                }
                let (value, pdf) = bsdf.evaluate::<All>(wo, s.direction);
                let tolerance = 1e-3 + RESOLUTION / width(bsdf) / f64::from(cosine);
                let near =
                    |a: f32, b: f32| f64::from((a - b).abs()) <= tolerance * f64::from(a.max(b)) + 1e-6;
                assert!(near(pdf, s.pdf), "{name} from {cosine}: pdf {} evaluated {pdf}", s.pdf);
                let weight = value / pdf;
                assert!(
                    (0..3).all(|c| near(weight[c], s.weight[c])),
                    "{name} from {cosine}: weight {} evaluated {weight}",
                    s.weight
                );
            }
        }
    }
}

/// Rounding of a unit direction. Values of lobes narrower than this are noise.
const RESOLUTION: f64 = 1e-6;
