//! What the statements of an MTL file mean: from [`MtlMaterial`] to the core's [`Material`]. The conventions
//! are those of `docs/loading.md`; that of plastics is argued in `docs/decisions/0002-plastic-from-mtl.md`.

use super::illum::{self, DARK_BASE, index, is_glass, is_pbr};
use super::map::Map;
use super::mtl::MtlMaterial;
use super::notes::Notes;
use super::relief::Relief;
use super::scene_file::BRIGHTEST;
use super::texture_set::TextureSet;
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, Material, NormalMap, ScalarInput, Surface};

/// How far `Ks` may be from the Fresnel reflectance of `Ni` for a coat to be read as a dielectric: files are
/// written with two or three digits.
const PLASTIC_TOLERANCE: f64 = 0.05;
/// Index of refraction where a file has glass or a PBR coat without `Ni`.
const DEFAULT_IOR: f64 = 1.5;
/// Heights of a bump map without `-bm`, in lengths of a texture-coordinate unit: a picture of a square metre of
/// bricks has joints a centimetre deep.
const DEFAULT_BUMP: f64 = 0.01;

/// The core's material for what the file says, with views of the textures that it needs.
pub(super) fn resolve(mtl: &MtlMaterial, textures: &mut TextureSet, notes: &mut Notes) -> Material {
    illum::note_what_is_lost(mtl, notes);
    let mut resolver = Resolver { mtl, textures, notes };
    let surface = resolver.surface();
    Material {
        surface,
        emission: resolver.emission(),
        two_sided: mtl.two_sided,
        opacity: resolver.opacity(),
        normal_map: resolver.normal_map(),
    }
}

/// The maps of a material.
pub(super) fn maps(mtl: &MtlMaterial) -> impl Iterator<Item = &Map> {
    let MtlMaterial { diffuse_map, specular_map, emission_map, roughness_map, .. } = mtl;
    let MtlMaterial { metallic_map, opacity_map, bump_map, normal_map, .. } = mtl;
    let colours = [diffuse_map, specular_map, emission_map];
    let numbers = [roughness_map, metallic_map, opacity_map, bump_map, normal_map];
    colours.into_iter().chain(numbers).flatten()
}

/// The same, to be changed.
pub(super) fn maps_mut(mtl: &mut MtlMaterial) -> impl Iterator<Item = &mut Map> {
    let MtlMaterial { diffuse_map, specular_map, emission_map, roughness_map, .. } = mtl;
    let MtlMaterial { metallic_map, opacity_map, bump_map, normal_map, .. } = mtl;
    let colours = [diffuse_map, specular_map, emission_map];
    let numbers = [roughness_map, metallic_map, opacity_map, bump_map, normal_map];
    colours.into_iter().chain(numbers).flatten()
}

struct Resolver<'a> {
    mtl: &'a MtlMaterial,
    textures: &'a mut TextureSet,
    notes: &'a mut Notes,
}

impl Resolver<'_> {
    /// `illum` decides what nothing more precise says: `Pr`, `Pm` and their maps win, and a diffuse base stays.
    fn surface(&mut self) -> Surface {
        if is_glass(self.mtl) {
            return self.glass();
        }
        let base = self.diffuse();
        let metallic = self.metallic();
        if metallic.texture.is_none() && metallic.value >= 1.0 {
            self.metal(base)
        } else if metallic == 0.0.into() && self.is_mirror(&base) {
            self.mirror(base)
        } else {
            self.coated(base, metallic)
        }
    }

    fn glass(&mut self) -> Surface {
        let roughness = match (self.mtl.roughness, &self.mtl.roughness_map) {
            (None, None) => 0.0.into(),
            _ => self.roughness(),
        };
        let tint = self.reflectance("Tf", self.mtl.tint.unwrap_or([1.0; 3]));
        Surface::Dielectric { ior: self.ior().unwrap_or(DEFAULT_IOR) as f32, tint, roughness }
    }

    /// A metal of colour `Kd`, or `Ks` where that is black or absent; a perfect mirror where `Pr` is 0.
    fn metal(&mut self, base: ColorInput) -> Surface {
        let is_absent = self.mtl.diffuse.is_none() && self.mtl.diffuse_map.is_none();
        let by_specular = self.has_specular() && (is_black(&base) || is_absent);
        let reflectance = if by_specular { self.specular() } else { base };
        if self.mtl.roughness == Some(0.0) && self.mtl.roughness_map.is_none() {
            return Surface::Mirror { reflectance };
        }
        Surface::Conductor { reflectance, roughness: self.roughness() }
    }

    /// Whether `illum 3` or `5` leaves nothing but a reflection: by `Ks`, with as good as no base, or by `Kd` alone,
    /// which is its colour then.
    fn is_mirror(&mut self, base: &ColorInput) -> bool {
        let Some(model @ (3 | 5)) = self.mtl.illumination else { return false };
        let is_dark = base.texture.is_none() && f64::from(base.value.max_element()) <= DARK_BASE;
        let (what, is_mirror) = match (self.has_specular(), is_dark) {
            (true, true) if is_black(base) => return true,
            (true, true) => ("is a mirror: its dark `Kd` is left out", true),
            (true, false) => ("is a reflection `Ks` over its `Kd`", false),
            (false, _) if is_pbr(self.mtl) || self.mtl.metallic.is_some() => {
                ("is what `Pr` and `Pm` say", false)
            }
            (false, _) if base.texture.is_some() => ("is diffuse: there is no `Ks` to reflect by", false),
            (false, _) => ("is a mirror of colour `Kd`: there is no `Ks`", true),
        };
        let name = &self.mtl.name;
        self.notes.add(1, format!("material `{name}` with `illum {model}` {what}"));
        is_mirror
    }

    /// `illum 3` reflects alike at all angles, `illum 5` by Fresnel's law; `Pr` may make either rough.
    fn mirror(&mut self, base: ColorInput) -> Surface {
        let reflectance = if self.has_specular() { self.specular() } else { base };
        let is_smooth = self.mtl.roughness.is_none_or(|pr| pr == 0.0) && self.mtl.roughness_map.is_none();
        match (self.mtl.illumination, is_smooth) {
            (Some(3), true) => Surface::Mirror { reflectance },
            (_, true) => Surface::Conductor { reflectance, roughness: 0.0.into() },
            (_, false) => Surface::Conductor { reflectance, roughness: self.roughness() },
        }
    }

    /// Diffuse, under a coat where there is one.
    fn coated(&mut self, base: ColorInput, metallic: ScalarInput) -> Surface {
        let (specular, ior) = if self.has_specular() {
            (self.specular(), self.plastic_ior())
        } else if is_pbr(self.mtl) {
            let ior = self.ior().unwrap_or(DEFAULT_IOR);
            (Rgb::splat(fresnel(ior) as f32).into(), Some(ior as f32))
        } else {
            (Rgb::ZERO.into(), None)
        };
        if is_black(&specular) && metallic.value == 0.0 {
            return Surface::Diffuse { reflectance: base };
        }
        Surface::Glossy { base, specular, roughness: self.roughness(), metallic, ior }
    }

    /// The index of a coat whose `Ks` is the Fresnel reflectance of its `Ni`.
    fn plastic_ior(&mut self) -> Option<f32> {
        let ior = self.ior()?;
        let specular = self.mtl.specular.filter(|_| self.mtl.specular_map.is_none())?;
        let expected = fresnel(ior);
        let agrees = specular.iter().all(|ks| (ks - expected).abs() <= PLASTIC_TOLERANCE * expected);
        (matches!(self.mtl.illumination, Some(2 | 3 | 5)) && expected > 0.0 && agrees).then_some(ior as f32)
    }

    /// Whether `Ks` counts: `illum 0` and `1` have no highlight unless `Pr` or `Pm` speaks of one.
    fn has_specular(&self) -> bool {
        let mtl = self.mtl;
        let is_matt = matches!(mtl.illumination, Some(0 | 1)) && !is_pbr(mtl);
        !is_matt && (mtl.specular.is_some() || mtl.specular_map.is_some())
    }

    fn specular(&mut self) -> ColorInput {
        let texture = self.textures.colour(self.mtl.specular_map.as_ref());
        let factor = self.factor("Ks", self.mtl.specular, [1.0; 3], texture.is_some());
        ColorInput { value: self.reflectance("Ks", factor), texture }
    }

    /// `Kd`; where there is none, white under a map, black where something else is said, else grey.
    fn diffuse(&mut self) -> ColorInput {
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
    fn roughness(&mut self) -> ScalarInput {
        let mtl = self.mtl;
        let texture = self.textures.scalar(mtl.roughness_map.as_ref());
        let from_shininess = |ns: f64| (2.0 / (ns.max(0.0) + 2.0)).powf(0.25);
        // The reflections of `illum 3` and `5` are sharp unless something says how rough they are.
        let absent = if matches!(mtl.illumination, Some(3 | 5)) { 0.0 } else { 1.0 };
        let absent = if texture.is_some() { 1.0 } else { mtl.shininess.map_or(absent, from_shininess) };
        let [value] = self.factor("Pr", mtl.roughness.map(|pr| [pr]), [absent], texture.is_some());
        ScalarInput { value: self.unit("Pr", value), texture }
    }

    fn metallic(&mut self) -> ScalarInput {
        let texture = self.textures.scalar(self.mtl.metallic_map.as_ref());
        let absent = if texture.is_some() { 1.0 } else { 0.0 };
        let [value] = self.factor("Pm", self.mtl.metallic.map(|pm| [pm]), [absent], texture.is_some());
        ScalarInput { value: self.unit("Pm", value), texture }
    }

    fn emission(&mut self) -> ColorInput {
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
    fn factor<const N: usize>(
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
    fn opacity(&mut self) -> ScalarInput {
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
    fn normal_map(&mut self) -> Option<NormalMap> {
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
    fn ior(&mut self) -> Option<f64> {
        let (ior, index) = (self.mtl.ior?, index(self.mtl));
        if index.is_none() {
            let name = &self.mtl.name;
            self.notes.add(1, format!("Ni {ior} of material `{name}` is no index of refraction: left out"));
        }
        index
    }

    /// A colour that reflects no more than it receives.
    fn reflectance(&mut self, what: &str, value: [f64; 3]) -> Rgb {
        value.map(|x| self.unit(what, x)).into()
    }

    fn unit(&mut self, what: &str, value: f64) -> f32 {
        if !(0.0..=1.0).contains(&value) {
            let name = &self.mtl.name;
            self.notes.add(1, format!("{what} {value} of material `{name}` is limited to 0 ... 1"));
        }
        value.clamp(0.0, 1.0) as f32
    }
}

fn is_black(colour: &ColorInput) -> bool {
    colour.value == Rgb::ZERO
}

/// Fresnel reflectance at normal incidence.
fn fresnel(ior: f64) -> f64 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::mtl;

    fn material(statements: &str) -> (Material, Vec<String>) {
        let text = format!("newmtl m\n{statements}");
        let mtl = mtl::parse(text.into_bytes(), "m.mtl");
        let mut notes = mtl.notes;
        let material = resolve(&mtl.materials[0], &mut TextureSet::default(), &mut notes);
        (material, notes.sentences())
    }

    fn surface(statements: &str) -> Surface {
        material(statements).0.surface
    }

    fn rgb(r: f32, g: f32, b: f32) -> ColorInput {
        Rgb::new(r, g, b).into()
    }

    #[test]
    fn diffuse() {
        let grey = Surface::Diffuse { reflectance: rgb(0.5, 0.5, 0.5) };
        assert_eq!(surface(""), grey);
        assert_eq!(surface("Kd 0.5 0.5 0.5\nKs 0 0 0\nNs 10\nNi 1.5\nillum 2"), grey);
        assert_eq!(surface("Kd 0.5 0.5 0.5\nKs 0 0 0\nPr 0.4\nPm 0"), grey);
        assert_eq!(surface("Ke 1 1 1"), Surface::Diffuse { reflectance: rgb(0.0, 0.0, 0.0) });
    }

    #[test]
    fn coats() {
        let plastic = "Kd 0.8 0.8 0.8\nKs 0.04 0.04 0.04\nNs 48\nNi 1.5\nPr 0.447214\nPm 0\n";
        let expected = |ior| Surface::Glossy {
            base: rgb(0.8, 0.8, 0.8),
            specular: rgb(0.04, 0.04, 0.04),
            roughness: 0.447214.into(),
            metallic: 0.0.into(),
            ior,
        };
        assert_eq!(surface(&format!("{plastic}illum 2")), expected(Some(1.5)));
        assert_eq!(surface(plastic), expected(None));
        let Surface::Glossy { ior, roughness, .. } =
            surface("Kd 1 1 1\nKs 0.3 0.3 0.3\nNi 1.5\nNs 198\nillum 2")
        else {
            panic!("not glossy")
        };
        assert_eq!(ior, None);
        assert!((roughness.value - 0.1f32.sqrt()).abs() < 1e-6);
        let Surface::Glossy { specular, ior, .. } = surface("Kd 1 0 0\nPr 0.5") else { panic!("not glossy") };
        assert_eq!((specular, ior), (rgb(0.04, 0.04, 0.04), Some(1.5)));
    }

    #[test]
    fn metals_and_mirrors() {
        let conductor = |reflectance| Surface::Conductor { reflectance, roughness: 0.5.into() };
        assert_eq!(surface("Kd 0 0 0\nKs 0.9 0.8 0.7\nPr 0.5\nPm 1"), conductor(rgb(0.9, 0.8, 0.7)));
        assert_eq!(surface("Kd 1 0.5 0\nKs 0.9 0.8 0.7\nPr 0.5\nPm 1"), conductor(rgb(1.0, 0.5, 0.0)));
        let mirror = Surface::Mirror { reflectance: rgb(0.9, 0.8, 0.7) };
        assert_eq!(surface("Kd 0 0 0\nKs 0.9 0.8 0.7\nillum 3"), mirror);
        assert_eq!(surface("Ks 0.9 0.8 0.7\nillum 3\nPr 0\nPm 1"), mirror);
        assert_eq!(surface("Kd 0 0 0\nKs 0.9 0.8 0.7\nillum 3\nPr 0\nPm 1\nNs 1000"), mirror);
        assert_eq!(surface("Kd 0.9 0.8 0.7\nillum 3"), mirror);
        assert_eq!(surface("Kd 0.9 0.8 0.7\nPm 1\nPr 0"), mirror);
        let smooth = Surface::Conductor { reflectance: rgb(0.95, 0.95, 0.95), roughness: 0.0.into() };
        assert_eq!(surface("Kd 0.01 0.01 0.01\nKs 0.95\nNs 1000\nillum 5"), smooth);
        let Surface::Glossy { metallic, .. } = surface("Kd 1 1 1\nKs 0.04\nPm 0.5") else {
            panic!("not glossy")
        };
        assert_eq!(metallic.value, 0.5);
    }

    #[test]
    fn illum_decides_only_what_nothing_more_precise_says() {
        // Blender's metals: the colour is `Kd`, `Ks` a grey specular.
        let gold = "Kd 0.8 0.6 0.2\nKs 0.5 0.5 0.5\nNs 250\nNi 1.45\n";
        for pbr in ["Pr 0.5\nPm 1", "Pr 0.5\nPm 0.5", "Pr 0.2\nPm 0.1", "Pr 0\nPm 1"] {
            assert_eq!(surface(&format!("{gold}{pbr}\nillum 3")), surface(&format!("{gold}{pbr}\nillum 2")));
        }
        let reflection = |roughness: f32| Surface::Glossy {
            base: rgb(0.375, 0.25, 0.125),
            specular: rgb(0.125, 0.125, 0.125),
            roughness: roughness.into(),
            metallic: 0.0.into(),
            ior: None,
        };
        let base = "Kd 0.375 0.25 0.125\nKs 0.125 0.125 0.125\n";
        for model in [3, 5] {
            let (found, notes) = material(&format!("{base}illum {model}"));
            assert_eq!(found.surface, reflection(0.0));
            assert!(
                notes[0].contains(&format!("`illum {model}`")) && notes[0].contains("over its `Kd`"),
                "{notes:?}"
            );
            assert_eq!(surface(&format!("{base}illum {model}\nPr 0.5")), reflection(0.5));
            let diffuse = Surface::Diffuse { reflectance: rgb(0.375, 0.25, 0.125) };
            assert_eq!(surface(&format!("Kd 0.375 0.25 0.125\nKs 0 0 0\nillum {model}")), diffuse);
        }
        for pbr in ["Pr 0.5", "Pr 0.5\nPm 0", "Pm 0"] {
            let without_ks = format!("Kd 0.375 0.25 0.125\n{pbr}\n");
            assert_eq!(
                surface(&format!("{without_ks}illum 3")),
                surface(&format!("{without_ks}illum 2")),
                "{pbr}"
            );
        }
        let rough = Surface::Conductor { reflectance: rgb(0.75, 0.75, 0.75), roughness: 0.25.into() };
        assert_eq!(surface("Kd 0 0 0\nKs 0.75 0.75 0.75\nPr 0.25\nillum 3"), rough);
    }

    #[test]
    fn illum_0_and_1_have_no_highlight() {
        let red = Surface::Diffuse { reflectance: rgb(0.5, 0.25, 0.125) };
        for model in [0, 1] {
            let (found, notes) = material(&format!("Kd 0.5 0.25 0.125\nKs 1 1 1\nNs 10\nillum {model}"));
            assert_eq!(found.surface, red);
            assert!(notes.len() == 1 && notes[0].contains("`Ks`"), "{notes:?}");
            let (found, notes) = material(&format!("Kd 0.5 0.25 0.125\nKs 0 0 0\nillum {model}"));
            assert_eq!((found.surface, notes.len()), (red, 0));
            let without = surface(&format!("Ks 1 1 1\nillum {model}"));
            assert_eq!(without, Surface::Diffuse { reflectance: rgb(0.5, 0.5, 0.5) });
            let pbr = surface(&format!("Kd 1 1 1\nKs 0.25 0.25 0.25\nPr 0.5\nillum {model}"));
            assert!(matches!(pbr, Surface::Glossy { specular, .. } if specular == rgb(0.25, 0.25, 0.25)));
        }
    }

    #[test]
    fn glass_that_bends_no_ray_is_opaque() {
        let kd = Surface::Diffuse { reflectance: rgb(0.5, 0.25, 0.125) };
        for (statements, opacity) in [
            ("Ni 1\nTf 1 1 1\nillum 4", 1.0),
            ("Ni 1.00\nillum 7", 1.0),
            ("Ni 1\nTf 0.5 0.5 0.5\nillum 4", 1.0),
            ("Ni 1\nd 0.25\nillum 6", 0.25),
            ("illum 4", 1.0),
            ("d 0.5\nillum 9", 0.5),
            ("Ni 1.45\nd 0.5\nillum 9", 0.5),
        ] {
            let (found, notes) = material(&format!("Kd 0.5 0.25 0.125\n{statements}"));
            assert_eq!((found.surface, found.opacity.value), (kd, opacity), "{statements}");
            assert!(notes.len() == 1 && notes[0].contains("no glass in spite of `illum"), "{notes:?}");
        }
        let black = Surface::Diffuse { reflectance: rgb(0.0, 0.0, 0.0) };
        assert_eq!(surface("Kd 0 0 0\nNi 1\nTf 1 1 1\nillum 4"), black);
        assert!(matches!(surface("Ni 1\nTf 0.5 1 1\nillum 4"), Surface::Dielectric { .. }));
        assert!(matches!(surface("Kd 1 1 1\nPm 1\nPr 0.5\nd 0.5\nillum 6"), Surface::Conductor { .. }));
        for glass in ["Ni 1.5\nillum 4", "Ni 1.5\nillum 9", "illum 7", "illum 6", "Tf 0.5 0.5 0.5\nillum 4"] {
            assert!(matches!(surface(&format!("Kd 0 0 0\n{glass}")), Surface::Dielectric { .. }), "{glass}");
            let (found, notes) = material(&format!("Kd 0.5 0.5 0.5\n{glass}"));
            assert!(matches!(found.surface, Surface::Dielectric { .. }), "{glass}");
            assert!(notes.len() == 1 && notes[0].contains("`Kd`"), "{notes:?}");
        }
    }

    #[test]
    fn glass() {
        let glass =
            |ior, roughness: f32| Surface::Dielectric { ior, tint: Rgb::ONE, roughness: roughness.into() };
        for model in [4, 6, 7, 9] {
            assert_eq!(
                surface(&format!("Kd 0 0 0\nKs 1 1 1\nNs 1e6\nNi 1.33\nillum {model}")),
                glass(1.33, 0.0)
            );
        }
        assert_eq!(surface("Ni 1.25\nPr 0.2\nillum 7"), glass(1.25, 0.2));
        let (material, notes) = material("Ni 0\nTf 2 1 -1\nd 0.1\nillum 7");
        assert_eq!(material.opacity.value, 1.0);
        let Surface::Dielectric { ior, tint, .. } = material.surface else { panic!("not glass") };
        assert_eq!((ior, tint), (1.5, Rgb::new(1.0, 1.0, 0.0)));
        assert_eq!(notes.len(), 4, "{notes:?}");
    }

    #[test]
    fn energy_is_limited_and_said() {
        let (material, notes) = material("Kd 2 0.5 -1\nKe -1 2 3\nd 0");
        assert_eq!(material.surface, Surface::Diffuse { reflectance: rgb(1.0, 0.5, 0.0) });
        assert_eq!(material.emission.value, Rgb::new(0.0, 2.0, 3.0));
        assert_eq!(material.opacity.value, 0.0);
        assert_eq!(notes.len(), 4, "{notes:?}");
    }
}
