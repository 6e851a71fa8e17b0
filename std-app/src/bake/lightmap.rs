//! Lightmaps: points of the texels of charts, and maps of their irradiances. Texels inside bodies take the
//! values of near ones of their chart, seams are stitched, and texels around charts take the values of their
//! neighbours.

use super::charts::{self, Charts, charts};
use super::grid::Grid;
use super::map::{Fetch, LightMap, Texel};
use super::raster::{self, EMPTY, Raster, Watch, weights};
use super::seams::{self, Seam, seams};
use super::table::Quantity;
use super::tilted::{bounded, linear, with_tilted};
use crate::load::LoadedScene;
use crate::memory::{Budget, Shortage};
use crate::render::Baked;
use crate::save::MAX_PIXELS;
use core::fmt;
use core::ops::Range;
use glam::{DVec2, Vec3};
use halflight_core::IrradiancePoint;
use halflight_core::scene::{Scene, Triangle};
use serde::{Deserialize, Serialize};

/// Bytes of a triangle while charts and then seams are found.
const BYTES_OF_TRIANGLE: usize = charts::BYTES_OF_TRIANGLE + seams::BYTES_OF_TRIANGLE;

/// Fraction of back faces from which a point is inside a body, unless most points of the map are.
const INSIDE: f32 = 0.5;

/// Settings of a lightmap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightmapSettings {
    /// Name of the meshes, objects or materials whose triangles have texels; `None`: all.
    pub subject: Option<String>,
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Points of each texel.
    pub points: u32,
    /// Rings of texels around charts that take the values of their neighbours.
    pub padding: u32,
    /// True if the irradiance of each texel is a linear function of the normal, from four normals.
    pub directional: bool,
    /// Layers of a directional map.
    #[serde(default)]
    pub layout: DirectionalLayout,
}

/// Layers of a directional map, one below the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum DirectionalLayout {
    /// a, and b along x, y and z, of the irradiance a + b·n by the normal n.
    #[default]
    Linear,
    /// Those of Godot: a, and ½ + b / (8 a) along y, z and x, with |b| at most 2 a.
    Godot,
}

/// Texels of a lightmap and their points.
#[derive(Debug)]
pub struct Lightmap {
    pub(super) settings: LightmapSettings,
    /// Chart of each texel, or [`EMPTY`].
    pub(super) charts: Vec<u32>,
    pub(super) chart_count: usize,
    pub(super) points: Vec<IrradiancePoint>,
    /// Texel of each point, or of each four of them with four normals.
    pub(super) texels: Vec<u32>,
    pub(super) seams: Vec<Seam>,
    /// Sentences on doubtful charts.
    pub notes: Vec<String>,
}

/// Reasons why there is no lightmap.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LightmapError {
    /// No mesh or material has this name; those of the scene.
    Subject(String, Vec<String>),
    /// The texture coordinates are no charts of a map.
    Charts(String),
    /// Texels whose centre lies in two triangles, and the texture coordinates of the first.
    Overlaps(usize, [u64; 2]),
    /// More texels than a picture can have.
    Texels,
    /// Insufficient memory.
    Memory(Shortage),
    /// The watch ended the work.
    Ended,
}

impl fmt::Display for LightmapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Subject(name, _) => write!(f, "no mesh, object or material is called `{name}`"),
            Self::Charts(why) => f.write_str(why),
            Self::Overlaps(count, uv) => {
                let [u, v] = uv.map(f64::from_bits);
                write!(
                    f,
                    "charts overlap in {count} texels, the first at texture coordinates ({u:.4}, {v:.4})"
                )
            }
            Self::Texels => write!(f, "the layers of the lightmap have more than {MAX_PIXELS} texels"),
            Self::Memory(why) => write!(f, "the lightmap is too large: {why}"),
            Self::Ended => f.write_str("the lightmap was ended before its texels had points"),
        }
    }
}

impl core::error::Error for LightmapError {}

impl LightmapError {
    /// The remedy.
    pub fn advice(&self) -> String {
        match self {
            Self::Subject(_, names) => format!("the names are all, {}", names.join(", ")),
            Self::Charts(_) | Self::Overlaps(..) => {
                "unwrap the mesh into one square without overlaps, as by smart_project of Blender (the command is in \
                 docs/bake.md) or by xatlas, or choose a mesh, an object or a material by --lightmap NAME"
                    .into()
            }
            Self::Texels => "lower --size".into(),
            Self::Memory(_) => "lower --size or --supersample, or raise --memory".into(),
            Self::Ended => String::new(),
        }
    }
}

impl Lightmap {
    /// The texels of `loaded` and their points. Texels are taken from `budget`; the points are counted by
    /// [`crate::bake::irradiance`]. `watch` is called with the fraction that is done; false ends the work.
    ///
    /// # Errors
    /// No charts, charts that overlap or leave the unit square, insufficient memory, an end by `watch`.
    pub fn new(
        loaded: &LoadedScene,
        settings: LightmapSettings,
        budget: &mut Budget,
        watch: Watch,
    ) -> Result<Self, LightmapError> {
        let texels = settings.size.map(|side| side as usize).iter().product::<usize>();
        let layers = settings.layers();
        if texels * layers > MAX_PIXELS {
            return Err(LightmapError::Texels);
        }
        let bytes_of_texel = size_of::<u32>() + raster::BYTES_OF_TEXEL + LightMap::bytes_of_texel(layers);
        let bytes = texels * bytes_of_texel + loaded.triangles.len() * BYTES_OF_TRIANGLE;
        budget.take(bytes).map_err(LightmapError::Memory)?;
        let is_chosen = chosen(loaded, settings.subject.as_deref())?;
        let of_scene = charts(loaded, is_chosen, settings.size).map_err(LightmapError::Charts)?;
        let raster = Raster::new(&of_scene, settings.size);
        // Charts are found in the first pass over the texels, and their points in others.
        let passes = f64::from(settings.points) + 1.0;
        let mut of_pass = |pass: u32, done: f64| watch((f64::from(pass) + done) / passes);
        let owners = raster.owners(DVec2::splat(0.5), |_, _| true, &mut |done| of_pass(0, done));
        let owners = owners.ok_or(LightmapError::Ended)?;
        if let Some((count, [x, y])) = owners.overlaps {
            let [width, height] = settings.size.map(f64::from);
            let uv = [(x as f64 + 0.5) / width, 1.0 - (y as f64 + 0.5) / height];
            return Err(LightmapError::Overlaps(count, uv.map(f64::to_bits)));
        }
        let notes = notes(&of_scene, owners.shared);
        let mut charts = owners.triangles;
        for owner in charts.iter_mut().filter(|owner| **owner != EMPTY) {
            *owner = of_scene.triangles[*owner as usize].chart;
        }
        let used = charts.iter().filter(|chart| **chart != EMPTY).count() * settings.points as usize;
        budget.take(used * size_of::<u32>()).map_err(LightmapError::Memory)?;
        budget.has(used * layers * size_of::<IrradiancePoint>()).map_err(LightmapError::Memory)?;
        let (points, texels) = (Vec::with_capacity(used * layers), Vec::with_capacity(used));
        let views = loaded.views();
        let seams = seams(&views.scene(loaded.camera_or_default()), loaded, &of_scene);
        let mut map = Self { settings, charts, chart_count: of_scene.count, points, texels, seams, notes };
        map.place(loaded, &of_scene, &mut |number, done| of_pass(number + 1, done))
            .ok_or(LightmapError::Ended)?;
        Ok(map)
    }

    /// Adds the points of all texels, spread evenly over each (Hammersley 1960).
    fn place(
        &mut self,
        loaded: &LoadedScene,
        charts: &Charts,
        watch: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<()> {
        let views = loaded.views();
        let scene = views.scene(loaded.camera_or_default());
        let raster = Raster::new(charts, self.settings.size);
        let count = self.settings.points;
        for number in 0..count {
            let across = (f64::from(number) + 0.5) / f64::from(count);
            let down = f64::from(number.reverse_bits()) / 2f64.powi(32);
            let offset = DVec2::new(across, down + 0.5 / f64::from(count.next_power_of_two()));
            let is_of_chart = |texel: usize, chart| self.charts[texel] == chart;
            let owners = raster.owners(offset, is_of_chart, &mut |done| watch(number, done))?;
            let width = self.settings.size[0] as usize;
            for (texel, owner) in owners.triangles.into_iter().enumerate() {
                let Some(triangle) = charts.triangles.get(owner as usize) else { continue };
                let place = DVec2::new((texel % width) as f64, (texel / width) as f64) + offset;
                self.add(&scene, texel as u32, (triangle.triangle, weights(triangle, place)));
            }
        }
        Some(())
    }

    /// Adds a point of a texel on the front of a triangle, by its normals.
    fn add(&mut self, scene: &Scene, texel: u32, (triangle, weights): (u32, [f32; 2])) {
        let Some(point) = IrradiancePoint::on_triangle(scene, triangle, weights, true) else { return };
        self.texels.push(texel);
        match self.settings.directional {
            true => {
                let normals = with_tilted(point.normal.into());
                self.points.extend(normals.map(|n| IrradiancePoint { normal: n.to_array(), ..point }));
            }
            false => self.points.push(point),
        }
    }

    /// The points at which irradiance is to be estimated.
    pub fn points(&self) -> &[IrradiancePoint] {
        &self.points
    }

    /// Number of texels of charts that take the values of others in `map`.
    pub fn filled(&self, map: &LightMap) -> usize {
        let is_filled = |(chart, texel): (&u32, &Texel)| *chart != EMPTY && *texel == Texel::Filled;
        self.charts.iter().zip(&map.texels).filter(|pair| is_filled(*pair)).count()
    }

    /// True if layers have values below 0.
    pub fn is_signed(&self) -> bool {
        self.settings.is_signed()
    }

    /// Number of charts.
    pub fn charts(&self) -> usize {
        self.chart_count
    }

    /// Number of chart texels without a value in `map`, since filling was ended.
    pub fn unfilled(&self, map: &LightMap) -> usize {
        let is_open = |(chart, texel): (&u32, &Texel)| *chart != EMPTY && *texel == Texel::Empty;
        self.charts.iter().zip(&map.texels).filter(|pair| is_open(*pair)).count()
    }

    /// The map of `baked` irradiances of the points. Without fractions of back faces all points are outside.
    /// No more texels are filled, and no more seams stitched, when `watch` returns false.
    pub fn map(&self, baked: &Baked, quantity: Quantity, watch: &dyn Fn() -> bool) -> LightMap {
        let layers = self.settings.layers();
        let mut map = LightMap::empty(self.settings.size, layers);
        let mut counts = vec![0u32; self.charts.len()];
        let bundles = baked.values.chunks_exact(layers).zip(self.points.chunks_exact(layers));
        let texels = self.texels.iter().zip(self.valid(&baked.back_faces));
        for ((values, points), (&texel, is_valid)) in bundles.zip(texels) {
            if !is_valid || values[0].samples == 0 {
                continue;
            }
            let fetch = match (values, points) {
                ([a, b, c, d], [e, f, g, h]) => {
                    let irradiances = [a, b, c, d].map(|value| value.irradiance.to_array());
                    let normals = [e, f, g, h].map(|point| point.normal.into());
                    directional(normals, irradiances, self.settings.layout)
                }
                _ => [values[0].irradiance.to_array(); 4],
            };
            let half_width = values[0].upper - values[0].value();
            map.add(texel as usize, &fetch, half_width);
            counts[texel as usize] += 1;
        }
        map.divide(&counts, quantity.scale());
        self.spread(&mut map, &counts, watch);
        if self.settings.directional && self.settings.layout == DirectionalLayout::Godot {
            map.encode_slopes();
        }
        map
    }

    /// Fills texels inside bodies, stitches seams, and fills texels around charts.
    fn spread(&self, map: &mut LightMap, counts: &[u32], watch: &dyn Fn() -> bool) {
        let [width, height] = self.settings.size.map(|side| side as usize);
        let grid = Grid([width, height, 1]);
        let mut is_known: Vec<bool> = counts.iter().map(|count| *count > 0).collect();
        let is_of_chart =
            |to: usize, from: usize| self.charts[to] != EMPTY && self.charts[to] == self.charts[from];
        grid.fill(&mut is_known, usize::MAX, is_of_chart, |texel, from| map.take(texel, from), watch);
        map.stitch(&self.seams, &is_known, watch);
        let rings = self.settings.padding as usize;
        grid.fill(&mut is_known, rings, |_, _| true, |texel, from| map.take(texel, from), watch);
    }

    /// False for each bundle that is inside a body. Scenes whose walls show their backs are not inside one,
    /// and no more are charts without a bundle outside.
    fn valid(&self, back_faces: &[f32]) -> Vec<bool> {
        let known = back_faces.iter().step_by(self.settings.layers()).copied();
        let shares: Vec<f32> = known.chain(core::iter::repeat(0.0)).take(self.texels.len()).collect();
        let mut sorted = shares.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let is_inverted = sorted.get(sorted.len() / 2).is_some_and(|median| *median > INSIDE);
        let is_outside = |share: &f32| is_inverted || *share <= INSIDE;
        let chart = |bundle: usize| self.charts[self.texels[bundle] as usize] as usize;
        let mut has_outside = vec![false; self.chart_count];
        for (bundle, share) in shares.iter().enumerate() {
            has_outside[chart(bundle)] |= is_outside(share);
        }
        let is_valid = |(bundle, share)| is_outside(share) || !has_outside[chart(bundle)];
        shares.iter().enumerate().map(is_valid).collect()
    }
}

impl LightmapSettings {
    /// True if layers have values below 0.
    pub fn is_signed(&self) -> bool {
        self.directional && self.layout == DirectionalLayout::Linear
    }

    pub(super) fn layers(&self) -> usize {
        if self.directional { 4 } else { 1 }
    }
}

/// True for triangles of the meshes, objects or materials of this name, by their number; `None`: all.
fn chosen<'a>(
    loaded: &'a LoadedScene,
    subject: Option<&'a str>,
) -> Result<impl Fn(u32, &Triangle) -> bool + 'a, LightmapError> {
    let LoadedScene { meshes, material_names, object_names, triangle_objects, .. } = loaded;
    let names = || meshes.iter().map(|(name, _)| name).chain(object_names).chain(material_names);
    if let Some(subject) = subject.filter(|subject| !names().any(|name| name == subject)) {
        let mut all: Vec<String> = names().filter(|name| !name.is_empty()).cloned().collect();
        all.sort_unstable();
        all.dedup();
        return Err(LightmapError::Subject(subject.to_owned(), all));
    }
    Ok(move |number: u32, triangle: &Triangle| {
        let is_of_mesh = |(name, vertices): &(String, Range<u32>)| {
            subject == Some(name) && vertices.contains(&triangle.vertices[0])
        };
        let material = material_names[triangle.material as usize].as_str();
        let object =
            triangle_objects.get(number as usize).and_then(|object| object_names.get(*object as usize));
        subject.is_none_or(|subject| subject == material || object.is_some_and(|object| object == subject))
            || meshes.iter().any(is_of_mesh)
    })
}

/// Constant and gradient of irradiance by its values at the normals of [`with_tilted`].
fn directional(normals: [Vec3; 4], irradiances: [[f32; 3]; 4], layout: DirectionalLayout) -> Fetch {
    let mut fetch = Fetch::default();
    for channel in 0..3 {
        let values = irradiances.map(|irradiance| irradiance[channel]);
        let (constant, slope) = match layout {
            DirectionalLayout::Linear => linear(normals, values),
            DirectionalLayout::Godot => bounded(normals[0], values[0], linear(normals, values).1),
        };
        let all = [constant, slope.x, slope.y, slope.z];
        fetch.iter_mut().zip(all).for_each(|(layer, value)| layer[channel] = value);
    }
    fetch
}

/// Sentences on charts that are usable with a loss.
fn notes(charts: &Charts, shared: usize) -> Vec<String> {
    let flat = (charts.flat > 0)
        .then(|| format!("{} triangles have no area in texture coordinates and get no texels", charts.flat));
    let shared = (shared > 0).then(|| {
        format!(
            "charts are so near that fetches in two of them read the same {shared} texels: leave 2 texels"
        )
    });
    [flat, shared].into_iter().flatten().collect()
}
