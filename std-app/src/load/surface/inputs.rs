//! Colours, numbers and textures of the statements, limited so that energy is conserved.

use super::Resolver;
use crate::load::illum::{index, is_glass};
use crate::load::mtl::MapKind;
use crate::load::relief::Relief;
use crate::load::scene_file::BRIGHTEST;
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, NormalMap, ScalarInput};

/// Factor on heights without `-bm`, in texture-coordinate units: a picture of a square metre of bricks has
/// joints a centimetre deep.
const DEFAULT_BUMP: f64 = 0.01;

/// True if a factor would hide its map. Exporters write 0 if only the map counts.
pub(super) fn hides_map<const N: usize>(factor: [f64; N], has_map: bool) -> bool {
    has_map && factor == [0.0; N]
}

impl Resolver<'_> {
    /// `Kd`; by default white under a map, black beside a `Ks` or `Ke`, else grey.
    pub(super) fn diffuse(&mut self) -> ColorInput {
        let mtl = self.mtl;
        let texture = self.textures.colour(mtl.map(MapKind::Diffuse));
        let has_other = self.has_specular() || mtl.emission.is_some() || mtl.has_map(MapKind::Emission);
        let absent = match (texture, has_other && mtl.metallic.is_none()) {
            (Some(_), _) => 1.0,
            (None, true) if !mtl.has_map(MapKind::Diffuse) => 0.0,
            (None, _) => 0.5,
        };
        let factor = self.factor("Kd", mtl.diffuse, [absent; 3], texture.is_some());
        let vertex_color = mtl.vertex_color == Some(MapKind::Diffuse);
        ColorInput { value: self.reflectance("Kd", factor), texture, vertex_color }
    }

    /// sqrt(alpha): `Pr`, else from `Ns` by alpha = sqrt(2 / (Ns + 2)).
    pub(super) fn roughness(&mut self) -> ScalarInput {
        let mtl = self.mtl;
        if let Some(coat) = mtl.coat {
            return self.coated_roughness(coat);
        }
        let texture = self.textures.scalar(mtl.map(MapKind::Roughness));
        let from_shininess = |ns: f64| (2.0 / (ns.max(0.0) + 2.0)).powf(0.25);
        // `illum 3` and `5` are smooth by default.
        let absent = if matches!(mtl.illumination, Some(3 | 5)) { 0.0 } else { 1.0 };
        let absent = if texture.is_some() { 1.0 } else { mtl.shininess.map_or(absent, from_shininess) };
        let [value] = self.factor("Pr", mtl.roughness.map(|pr| [pr]), [absent], texture.is_some());
        ScalarInput { texture, ..self.unit("Pr", value).into() }
    }

    pub(super) fn metallic(&mut self) -> ScalarInput {
        let texture = self.textures.scalar(self.mtl.map(MapKind::Metallic));
        let absent = if texture.is_some() { 1.0 } else { 0.0 };
        let [value] = self.factor("Pm", self.mtl.metallic.map(|pm| [pm]), [absent], texture.is_some());
        ScalarInput { texture, ..self.unit("Pm", value).into() }
    }

    pub(super) fn emission(&mut self) -> ColorInput {
        let texture = self.textures.colour(self.mtl.map(MapKind::Emission));
        let absent = if texture.is_some() { 1.0 } else { 0.0 };
        let value = self.factor("Ke", self.mtl.emission, [absent; 3], texture.is_some());
        if value.iter().any(|&x| !(0.0..=BRIGHTEST).contains(&x)) {
            let name = &self.mtl.name;
            self.notes.add(1, format!("Ke of material `{name}` is limited to 0 ... {BRIGHTEST:e}"));
        }
        let value = value.map(|x| x.clamp(0.0, BRIGHTEST) as f32).into();
        let vertex_color = self.mtl.vertex_color == Some(MapKind::Emission);
        ColorInput { value, texture, vertex_color }
    }

    /// The factor on a map, or the value without one; 1 where it hides the map.
    pub(super) fn factor<const N: usize>(
        &mut self,
        what: &str,
        given: Option<[f64; N]>,
        absent: [f64; N],
        has_map: bool,
    ) -> [f64; N] {
        let factor = given.unwrap_or(absent);
        if self.mtl.exact || !hides_map(factor, has_map) {
            return factor;
        }
        let name = &self.mtl.name;
        let note = format!("`{what}` of material `{name}` is 0 and would hide its map: the map counts alone");
        self.notes.add(1, note);
        [1.0; N]
    }

    /// `d`; 1 for glass, which transmits light by refraction.
    pub(super) fn opacity(&mut self) -> ScalarInput {
        let mtl = self.mtl;
        // An exact map without alpha is opaque.
        let map = mtl.map(MapKind::Opacity).filter(|map| !mtl.exact || self.textures.has_alpha(map));
        let texture = self.textures.opacity(map);
        let [value] = self.factor("d", mtl.opacity.map(|d| [d]), [1.0], texture.is_some());
        let value = if is_glass(mtl) && value < 1.0 {
            self.notes.add(1, "`d` of a glass (illum 4, 6, 7, 9) left out: it refracts, it is not cut out");
            1.0
        } else {
            self.unit("d", value)
        };
        if value == 0.0 {
            self.notes.add(1, format!("material `{}` is invisible: its opacity is 0", mtl.name));
        }
        ScalarInput { value, texture, vertex_alpha: mtl.vertex_alpha }
    }

    /// `norm`, else `bump`. The picture itself decides if it contradicts its statement.
    pub(super) fn normal_map(&mut self) -> Option<NormalMap> {
        let mtl = self.mtl;
        let normals = mtl.map(MapKind::Normal).filter(|map| self.textures.relief(map).is_some());
        if let Some(map) = mtl.map(MapKind::Normal).filter(|_| mtl.exact) {
            let scale = map.options.bump_multiplier.unwrap_or(1.0) as f32;
            return Some(NormalMap::Tangent(self.textures.data(Some(map))?, scale));
        }
        let (map, statement) = match normals {
            Some(map) => (map, "norm"),
            None => (mtl.map(MapKind::Bump)?, "bump"),
        };
        let relief = self.textures.relief(map)?;
        let name = map.found.as_ref().map(|file| file.display().to_string()).unwrap_or_default();
        let is_normals = match (statement, relief) {
            ("bump", Relief::Normals) => {
                self.notes.add(1, format!("texture {name} of a `bump` is a map of normals and used as one"));
                true
            }
            ("norm", Relief::Heights) => {
                self.notes.add(1, format!("texture {name} of a `norm` is grey: it is used as heights"));
                false
            }
            (statement, _) => statement == "norm",
        };
        let multiplier = map.options.bump_multiplier;
        if is_normals {
            let id = self.textures.data(Some(map))?;
            return Some(NormalMap::Tangent(id, multiplier.unwrap_or(1.0) as f32));
        }
        let id = self.textures.heights(map)?;
        if multiplier.is_none() {
            let note = format!("heights of {name} have no `-bm`: they are multiplied by {DEFAULT_BUMP}");
            self.notes.add(1, note);
        }
        Some(NormalMap::Height(id, multiplier.unwrap_or(DEFAULT_BUMP) as f32))
    }

    /// `Ni`, if it is valid.
    pub(super) fn ior(&mut self) -> Option<f64> {
        let (ior, index) = (self.mtl.ior?, index(self.mtl));
        if index.is_none() {
            let name = &self.mtl.name;
            self.notes.add(1, format!("Ni {ior} of material `{name}` is no index of refraction: left out"));
        }
        index
    }

    /// A colour clamped to 0 ... 1.
    pub(super) fn reflectance(&mut self, what: &str, value: [f64; 3]) -> Rgb {
        value.map(|x| self.unit(what, x)).into()
    }

    /// A number clamped to 0 ... 1.
    pub(super) fn unit(&mut self, what: &str, value: f64) -> f32 {
        if !(0.0..=1.0).contains(&value) {
            let name = &self.mtl.name;
            self.notes.add(1, format!("{what} {value} of material `{name}` is limited to 0 ... 1"));
        }
        value.clamp(0.0, 1.0) as f32
    }
}
