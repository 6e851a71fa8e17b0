//! Values of a material's statements: colours, numbers and their textures, within the limits of energy.

use super::Resolver;
use crate::load::illum::{index, is_glass};
use crate::load::relief::Relief;
use crate::load::scene_file::BRIGHTEST;
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, NormalMap, ScalarInput};

/// Heights of a bump map without `-bm`, in lengths of a texture-coordinate unit: a picture of a square metre of
/// bricks has joints a centimetre deep.
const DEFAULT_BUMP: f64 = 0.01;

impl Resolver<'_> {
    /// `Kd`; where there is none, white under a map, black where something else is said, else grey.
    pub(super) fn diffuse(&mut self) -> ColorInput {
        let mtl = self.mtl;
        let texture = self.textures.colour(mtl.diffuse_map.as_ref());
        let says_more = self.has_specular() || mtl.emission.is_some() || mtl.emission_map.is_some();
        let absent = match (texture, says_more && mtl.metallic.is_none()) {
            (Some(_), _) => 1.0,
            (None, true) if mtl.diffuse_map.is_none() => 0.0,
            (None, _) => 0.5,
        };
        let factor = self.factor("Kd", mtl.diffuse, [absent; 3], texture.is_some());
        ColorInput { value: self.reflectance("Kd", factor), texture }
    }

    /// sqrt(alpha): `Pr`, else from `Ns` by alpha = sqrt(2 / (Ns + 2)).
    pub(super) fn roughness(&mut self) -> ScalarInput {
        let mtl = self.mtl;
        let texture = self.textures.scalar(mtl.roughness_map.as_ref());
        let from_shininess = |ns: f64| (2.0 / (ns.max(0.0) + 2.0)).powf(0.25);
        // The reflections of `illum 3` and `5` are sharp unless something says how rough they are.
        let absent = if matches!(mtl.illumination, Some(3 | 5)) { 0.0 } else { 1.0 };
        let absent = if texture.is_some() { 1.0 } else { mtl.shininess.map_or(absent, from_shininess) };
        let [value] = self.factor("Pr", mtl.roughness.map(|pr| [pr]), [absent], texture.is_some());
        ScalarInput { value: self.unit("Pr", value), texture }
    }

    pub(super) fn metallic(&mut self) -> ScalarInput {
        let texture = self.textures.scalar(self.mtl.metallic_map.as_ref());
        let absent = if texture.is_some() { 1.0 } else { 0.0 };
        let [value] = self.factor("Pm", self.mtl.metallic.map(|pm| [pm]), [absent], texture.is_some());
        ScalarInput { value: self.unit("Pm", value), texture }
    }

    pub(super) fn emission(&mut self) -> ColorInput {
        let texture = self.textures.colour(self.mtl.emission_map.as_ref());
        let absent = if texture.is_some() { 1.0 } else { 0.0 };
        let value = self.factor("Ke", self.mtl.emission, [absent; 3], texture.is_some());
        if value.iter().any(|&x| !(0.0..=BRIGHTEST).contains(&x)) {
            let name = &self.mtl.name;
            self.notes.add(1, format!("Ke of material `{name}` is limited to 0 ... {BRIGHTEST:e}"));
        }
        let value = value.map(|x| x.clamp(0.0, BRIGHTEST) as f32).into();
        ColorInput { value, texture }
    }

    /// What multiplies a map, or stands alone. A factor of 0 hides its own map, which nobody means: exporters write it
    /// where the map is all that counts.
    pub(super) fn factor<const N: usize>(
        &mut self,
        what: &str,
        given: Option<[f64; N]>,
        absent: [f64; N],
        has_map: bool,
    ) -> [f64; N] {
        let factor = given.unwrap_or(absent);
        if !(has_map && factor == [0.0; N]) {
            return factor;
        }
        let name = &self.mtl.name;
        self.notes.add(
            1,
            format!("`{what}` of material `{name}` is 0 and would hide its map: the map counts alone"),
        );
        [1.0; N]
    }

    /// `d`; glass lets light through by refraction alone.
    pub(super) fn opacity(&mut self) -> ScalarInput {
        let mtl = self.mtl;
        let texture = self.textures.opacity(mtl.opacity_map.as_ref());
        let [value] = self.factor("d", mtl.opacity.map(|d| [d]), [1.0], texture.is_some());
        let value = if is_glass(mtl) && value < 1.0 {
            self.notes.add(1, "`d` of a glass (illum 4, 6, 7, 9) left out: it refracts, it is not cut out");
            1.0
        } else {
            self.unit("d", value)
        };
        if value == 0.0 {
            self.notes.add(1, format!("material `{}` has opacity 0 and cannot be seen", mtl.name));
        }
        ScalarInput { value, texture }
    }

    /// `norm`, else `bump`. A picture that cannot be what its statement says is taken for what it is.
    pub(super) fn normal_map(&mut self) -> Option<NormalMap> {
        let mtl = self.mtl;
        let normals = mtl.normal_map.as_ref().filter(|map| self.textures.relief(map).is_some());
        let (map, statement) = match normals {
            Some(map) => (map, "norm"),
            None => (mtl.bump_map.as_ref()?, "bump"),
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
        let id = self.textures.data(Some(map))?;
        let multiplier = map.options.bump_multiplier;
        if is_normals {
            return Some(NormalMap::Tangent(id, multiplier.unwrap_or(1.0) as f32));
        }
        if multiplier.is_none() {
            self.notes
                .add(1, format!("heights of {name} have no `-bm`: they are taken times {DEFAULT_BUMP}"));
        }
        Some(NormalMap::Height(id, multiplier.unwrap_or(DEFAULT_BUMP) as f32))
    }

    /// `Ni`, where it can be one.
    pub(super) fn ior(&mut self) -> Option<f64> {
        let (ior, index) = (self.mtl.ior?, index(self.mtl));
        if index.is_none() {
            let name = &self.mtl.name;
            self.notes.add(1, format!("Ni {ior} of material `{name}` is no index of refraction: left out"));
        }
        index
    }

    /// A colour that reflects no more than it receives.
    pub(super) fn reflectance(&mut self, what: &str, value: [f64; 3]) -> Rgb {
        value.map(|x| self.unit(what, x)).into()
    }

    pub(super) fn unit(&mut self, what: &str, value: f64) -> f32 {
        if !(0.0..=1.0).contains(&value) {
            let name = &self.mtl.name;
            self.notes.add(1, format!("{what} {value} of material `{name}` is limited to 0 ... 1"));
        }
        value.clamp(0.0, 1.0) as f32
    }
}
