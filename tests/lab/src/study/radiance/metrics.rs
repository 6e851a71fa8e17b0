//! Error of the light that metal reflects between records, for error metrics at equal numbers of records.
//!
//! Records lie on the floors of the rooms, at random points that no earlier record covers. The error of each
//! metric is searched that gives the number of records. All have the same weights and no comparison of
//! neighbours, and the light of gather rays has no noise.

use super::rooms::Room;
use super::{Row, hemisphere};
use glam::{DVec3, Vec2, Vec3};
use halflight::pages::Pages;
use halflight_core::bsdf::{All, Bsdf, Conductor};
use halflight_core::cache::irradiance::metric::Settings;
use halflight_core::cache::irradiance::{
    CellFlux, Derivatives, GREATEST_DEVIATION, Metric, QueryPoint, Record, Validity, validity,
};
use halflight_core::cache::radiance::derivatives::{CoefficientDerivatives, border_flux};
use halflight_core::cache::radiance::lobes::LobeTable;
use halflight_core::cache::radiance::sh::{self, ShCoefficients, ShTables};
use halflight_core::cache::radiance::{Basis, Coefficients, StrataTables, zernike};
use halflight_core::geometry::Frame;
use halflight_core::memory::{Arena, OutOfMemory};
use halflight_core::sampling::warp::cosine_hemisphere;
use halflight_core::{Level, Rgb};
use halflight_test_support::{GatherRays, Random};
use serde_json::{Value, json};

/// Numbers of records.
const RECORDS: [usize; 3] = [60, 150, 300];

/// Alpha of the metal.
const ALPHA: f32 = 0.3;
/// Strata along a side, and degrees of both bases.
const STRATA: usize = 32;
const DEGREE: usize = 6;
/// Gradients stop two degrees below the values.
const SLOPES: usize = zernike::count(DEGREE - 2);
/// Points where a record may lie, points of comparison, and orders of the former.
const CANDIDATES: usize = 1200;
const POINTS: usize = 400;
const ORDERS: usize = 3;
/// Strata along a side for exact light.
const EXACT: usize = 96;
/// Limits of extrapolation, as in the renderer.
const EXTRAPOLATION: [f32; 2] = [0.05, 20.0];

/// Rule for the radii.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Rule {
    /// By the irradiance.
    Irradiance(Metric),
    /// By the radiance that leaves.
    Leaving(Metric),
    /// By the one whose shorter radius is smaller.
    Both(Metric),
}

/// Rows of the table: name, basis, rule.
pub(super) const RULES: [(&str, Basis, Rule); 7] = [
    ("split-sphere", Basis::Zernike, Rule::Irradiance(Metric::SplitSphere)),
    ("bounded by gradient", Basis::Zernike, Rule::Leaving(Metric::BoundedSplitSphere)),
    ("unoccluded Hessian of E", Basis::Zernike, Rule::Irradiance(Metric::RadiometricHessian)),
    ("Hessian of E", Basis::Zernike, Rule::Irradiance(Metric::Halflight)),
    ("larger Hessian of E and Lo", Basis::Zernike, Rule::Both(Metric::Halflight)),
    ("split-sphere", Basis::SphericalHarmonics, Rule::Irradiance(Metric::SplitSphere)),
    ("Hessian of E", Basis::SphericalHarmonics, Rule::Irradiance(Metric::Halflight)),
];

/// Errors of a rule in a room.
pub(super) struct RadianceMetricError {
    /// Name of the room.
    room: &'static str,
    /// The basis.
    basis: Basis,
    /// Name of the rule.
    rule: &'static str,
    /// Root mean square error over the mean of the light, for [`RECORDS`].
    errors: [f64; RECORDS.len()],
    /// The same with a hemisphere at each point of comparison.
    own: f64,
}

impl Row for RadianceMetricError {
    fn head() -> String {
        let counts = RECORDS.map(|count| format!("{count:>8}")).concat();
        format!(
            "error of light from metal of alpha 0.3 between records, over the mean light, by number of records\n\
             room     basis    radii                       {counts}   at records"
        )
    }

    fn line(&self) -> String {
        let errors = self.errors.map(|error| format!("{error:>8.4}")).concat();
        format!("{:<8} {:<8} {:<28}{errors}     {:>8.4}", self.room, self.basis.name(), self.rule, self.own)
    }

    fn object(&self) -> Value {
        let errors: Vec<_> = RECORDS
            .into_iter()
            .zip(self.errors)
            .map(|(records, error)| json!({ "records": records, "error": error }))
            .collect();
        json!({
            "room": self.room,
            "basis": self.basis.name(),
            "radii": self.rule,
            "errors": errors,
            "at_records": self.own,
        })
    }
}

/// Light at a point of the floor, in coefficients of both bases.
pub(super) struct Gathered {
    position: Vec3,
    /// Coefficients, and their gradients.
    values: [Vec<f32>; 2],
    slopes: [Vec<[f32; 2]>; 2],
    /// Irradiance with the Hessian of both kinds, and the light that leaves.
    by_flux: Derivatives,
    unoccluded: Derivatives,
    leaving: Derivatives,
}

/// Memory of the tables.
pub(super) struct Buffers {
    strata: Pages,
    sh: Pages,
    flux: Pages,
    lobes: Pages,
}

impl Buffers {
    pub(super) fn new() -> Result<Self, OutOfMemory> {
        Ok(Self {
            strata: Pages::new(StrataTables::footprint(STRATA, DEGREE))?,
            sh: Pages::new(ShTables::footprint(STRATA, sh::ORDER_MAX))?,
            flux: Pages::new(CellFlux::footprint(STRATA))?,
            lobes: Pages::new(
                LobeTable::footprint(Basis::Zernike).and(LobeTable::footprint(Basis::SphericalHarmonics)),
            )?,
        })
    }
}

/// Tables of both bases.
pub(super) struct Tables<'m> {
    level: Level,
    strata: StrataTables<'m>,
    sh: ShTables<'m>,
    flux: CellFlux<'m>,
    lobes: [LobeTable<'m>; 2],
}

impl<'m> Tables<'m> {
    pub(super) fn new(buffers: &'m mut Buffers) -> Result<Self, OutOfMemory> {
        let mut arena = Arena::over(&mut buffers.lobes);
        Ok(Self {
            level: Level::detect(),
            strata: StrataTables::build(STRATA, DEGREE, &mut Arena::over(&mut buffers.strata))?,
            sh: ShTables::build(STRATA, sh::ORDER_MAX, &mut Arena::over(&mut buffers.sh))?,
            flux: CellFlux::build(STRATA, &mut Arena::over(&mut buffers.flux))?,
            lobes: [
                LobeTable::build(Basis::Zernike, &mut arena)?,
                LobeTable::build(Basis::SphericalHarmonics, &mut arena)?,
            ],
        })
    }

    /// Weights of the coefficients of a basis for the viewer `wo`, whose angle is one of the table.
    fn weights(&self, basis: usize, wo: Vec3) -> Vec<f32> {
        let lobe = self.lobes[basis].lobe(wo.z, ALPHA).map(|lobe| lobe.turned(wo.truncate()).of(1.0));
        lobe.map_or_else(Vec::new, |weights| weights.to_vec())
    }

    /// Gathers at `from`.
    fn gather(&self, room: &Room, from: DVec3, random: &mut Random) -> Option<Gathered> {
        let hit = |w: Vec3| room.hit(from, w.as_dvec3().normalize());
        let rays = GatherRays::new(STRATA, cosine_hemisphere, || random.unit(), hit);
        let hemisphere = hemisphere(&rays)?;
        let light = Coefficients::project(self.level, &self.strata, &hemisphere)?;
        let changes = border_flux(self.level, &self.strata, &hemisphere)?;
        let harmonics = ShCoefficients::project(self.level, &self.sh, &hemisphere)?;
        let blind = sh::unoccluded(&self.sh, &hemisphere)?;
        let by_flux = self.flux.derivatives(self.level, &hemisphere)?;
        let weights = self.weights(0, viewer(room, from));
        let leaving = leaving(&by_flux, &weights, &light, &changes);
        Some(Gathered {
            position: from.as_vec3(),
            values: [light.values[0].to_vec(), harmonics.values[0].to_vec()],
            slopes: [changes.gradients[0][..SLOPES].to_vec(), blind[0].to_vec()],
            unoccluded: Metric::RadiometricHessian.derivatives(self.level, &self.flux, &hemisphere)?,
            by_flux,
            leaving,
        })
    }
}

/// Derivatives of the light that leaves in place of those of the irradiance.
fn leaving(
    of_irradiance: &Derivatives,
    weights: &[f32],
    light: &Coefficients,
    changes: &CoefficientDerivatives,
) -> Derivatives {
    let radiance: f32 = light.values[0].iter().zip(weights).map(|(value, weight)| value * weight).sum();
    Derivatives {
        irradiance: Rgb::splat(radiance.max(0.0)),
        gradient: [changes.gradient(0, weights); 3],
        hessian: changes.hessian(weights),
        ..*of_irradiance
    }
}

/// Unit direction to the eye, which is outside of the room.
fn viewer(room: &Room, from: DVec3) -> Vec3 {
    (DVec3::new(0.5 * room.width(), -0.6, 1.0) - from).normalize().as_vec3()
}

/// Exact light that leaves.
fn exact(room: &Room, from: DVec3) -> f64 {
    let (wo, bsdf) = (viewer(room, from), Bsdf::Conductor(Conductor { f0: Rgb::ONE, alpha: ALPHA }));
    let centre = |k: usize| (k as f32 + 0.5) / EXACT as f32;
    let of_stratum = |c: usize| {
        let wi = cosine_hemisphere([centre(c % EXACT), centre(c / EXACT)]);
        let f = f64::from(bsdf.evaluate::<All>(wo, wi).0.x / wi.z);
        f * room.radiance(from, wi.as_dvec3()).0
    };
    core::f64::consts::PI / (EXACT * EXACT) as f64 * (0..EXACT * EXACT).map(of_stratum).sum::<f64>()
}

/// Point of comparison.
pub(super) struct Point {
    position: Vec3,
    pub(super) exact: f64,
    weights: [Vec<f32>; 2],
    own: [f64; 2],
}

/// Σ w (λ + ∇λ · Δ), within the limits.
fn extrapolated(gathered: &Gathered, basis: usize, weights: &[f32], delta: Vec2, scale: f32) -> f32 {
    let own: f32 = gathered.values[basis].iter().zip(weights).map(|(value, weight)| value * weight).sum();
    let slopes = gathered.slopes[basis].iter().zip(weights);
    let slope: Vec2 = slopes.map(|(&slope, &weight)| weight * Vec2::from(slope)).sum();
    let here = own.max(0.0);
    (own + scale * slope.dot(delta)).max(EXTRAPOLATION[0] * here).min(EXTRAPOLATION[1] * here)
}

/// Records of a rule.
pub(super) struct Placed<'g> {
    records: Vec<(Record, &'g Gathered, f32)>,
}

impl Rule {
    fn validity(self, gathered: &Gathered, (error, extent): (f32, f32)) -> Validity {
        let settings = |metric| Settings { error, ..Settings::new(metric, extent) };
        let of = |metric, derivatives| validity(&settings(metric), derivatives);
        match self {
            Rule::Irradiance(metric @ Metric::RadiometricHessian) => of(metric, &gathered.unoccluded),
            Rule::Irradiance(metric) => of(metric, &gathered.by_flux),
            Rule::Leaving(metric) => of(metric, &gathered.leaving),
            Rule::Both(metric) => {
                let [a, b] =
                    [&gathered.by_flux, &gathered.leaving].map(|derivatives| of(metric, derivatives));
                if a.radii[0] <= b.radii[0] { a } else { b }
            }
        }
    }
}

const FRAME: Frame = Frame { tangent: Vec3::X, bitangent: Vec3::Y, normal: Vec3::Z };

impl<'g> Placed<'g> {
    fn new(rule: Rule, sizes: (f32, f32), candidates: impl Iterator<Item = &'g Gathered>) -> Self {
        let mut placed = Self { records: Vec::new() };
        let least_cos = GREATEST_DEVIATION.cos();
        for gathered in candidates {
            let point = QueryPoint::open(gathered.position, Vec3::Z);
            if placed.records.iter().any(|(record, ..)| record.covers(&point, least_cos)) {
                continue;
            }
            let region = rule.validity(gathered, sizes);
            let record = Record::new(gathered.position, &FRAME, &gathered.by_flux, &region);
            let record = Record { overlap: 1.0, reach: record.radii[1], allowed: 0.0, least: 0.0, ..record };
            placed.records.push((record, gathered, region.gradient_scale));
        }
        placed
    }

    /// Positions of the records.
    pub(super) fn positions(&self) -> impl Iterator<Item = Vec3> {
        self.records.iter().map(|(record, ..)| record.position.into())
    }

    /// Interpolated light, of the nearest record in radii where none is valid.
    pub(super) fn at(&self, basis: usize, point: &Point) -> f32 {
        let (mut sum, mut total, mut nearest) = (0.0, 0.0, (f32::INFINITY, 0.0));
        let query = QueryPoint::open(point.position, Vec3::Z);
        for (record, gathered, scale) in &self.records {
            let weight = record.at(&query, GREATEST_DEVIATION.cos()).map(|(_, weight)| weight);
            let radii = record.radii_to(point.position);
            if weight.is_none() && radii >= nearest.0 {
                continue;
            }
            let delta = (point.position - gathered.position).truncate();
            let light = extrapolated(gathered, basis, &point.weights[basis], delta, *scale);
            if let Some(weight) = weight {
                (sum, total) = (sum + weight * light, total + weight);
            } else {
                nearest = (radii, light);
            }
        }
        if total > 0.0 { sum / total } else { nearest.1 }
    }
}

/// Records whose number is nearest to `wanted`, by bisection of the error.
pub(super) fn of_count<'g>(
    rule: Rule,
    extent: f32,
    wanted: usize,
    candidates: impl Iterator<Item = &'g Gathered> + Clone,
) -> Placed<'g> {
    let (mut low, mut high) = (1e-9f32.ln(), 100f32.ln());
    let mut best: Option<Placed> = None;
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        let placed = Placed::new(rule, (middle.exp(), extent), candidates.clone());
        let count = placed.records.len();
        if count > wanted {
            low = middle
        } else {
            high = middle
        }
        if best.as_ref().is_none_or(|best| count.abs_diff(wanted) <= best.records.len().abs_diff(wanted)) {
            best = Some(placed);
        }
        if count == wanted {
            break;
        }
    }
    best.unwrap_or(Placed { records: Vec::new() })
}

/// Light at random points of the floor.
pub(super) fn candidates(tables: &Tables, room: &Room, random: &mut Random) -> Vec<Gathered> {
    let at = (0..CANDIDATES).map(|_| room.receiver(random)).collect::<Vec<_>>();
    at.into_iter().filter_map(|from| tables.gather(room, from, random)).collect()
}

/// Root mean square of the differences of `found` over the mean of the exact light.
fn relative(points: &[Point], found: impl Fn(&Point) -> f64) -> f64 {
    let count = points.len() as f64;
    let mean = points.iter().map(|point| point.exact).sum::<f64>() / count;
    let squares = points.iter().map(|point| (found(point) - point.exact).powi(2)).sum::<f64>();
    (squares / count).sqrt() / mean
}

/// Errors of all rules in all rooms; calls `each` after each.
pub(super) fn measure(each: &mut dyn FnMut(&RadianceMetricError)) -> Result<(), OutOfMemory> {
    let mut buffers = Buffers::new()?;
    let tables = Tables::new(&mut buffers)?;
    for (name, room) in ["box", "sun", "columns"].into_iter().zip(Room::all()) {
        let mut random = Random(41);
        let candidates = candidates(&tables, &room, &mut random);
        let at = (0..POINTS).map(|_| room.receiver(&mut random)).collect::<Vec<_>>();
        let points: Vec<_> = at.iter().filter_map(|&from| point(&tables, &room, from, &mut random)).collect();
        for (rule, basis, radii) in RULES {
            let number = usize::from(basis == Basis::SphericalHarmonics);
            let errors = RECORDS.map(|wanted| {
                let of_order = |order: usize| {
                    let start = order * CANDIDATES / ORDERS;
                    let candidates = candidates.iter().cycle().skip(start).take(candidates.len());
                    let placed = of_count(radii, room.extent() as f32, wanted, candidates);
                    relative(&points, |point| placed.at(number, point).into()).powi(2)
                };
                ((0..ORDERS).map(of_order).sum::<f64>() / ORDERS as f64).sqrt()
            });
            let own = relative(&points, |point| point.own[number]);
            each(&RadianceMetricError { room: name, basis, rule, errors, own });
        }
    }
    Ok(())
}

pub(super) fn point(tables: &Tables, room: &Room, from: DVec3, random: &mut Random) -> Option<Point> {
    let gathered = tables.gather(room, from, random)?;
    let weights = [0, 1].map(|basis| tables.weights(basis, viewer(room, from)));
    let own = [0, 1].map(|basis| f64::from(extrapolated(&gathered, basis, &weights[basis], Vec2::ZERO, 0.0)));
    Some(Point { position: gathered.position, exact: exact(room, from), weights, own })
}
