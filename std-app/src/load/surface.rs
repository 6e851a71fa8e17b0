//! What the statements of an MTL file mean: from [`MtlMaterial`] to the core's [`Material`]. The conventions
//! are those of `docs/loading.md`; that of plastics is argued in `docs/decisions/0002-plastic-from-mtl.md`.

use super::map::Map;
use super::mtl::MtlMaterial;
use super::notes::Notes;
use super::texture_set::TextureSet;
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, Material, NormalMap, ScalarInput, Surface};

/// How far `Ks` may be from the Fresnel reflectance of `Ni` for a coat to be read as a dielectric: files are
/// written with two or three digits.
const PLASTIC_TOLERANCE: f64 = 0.05;
/// Index of refraction where a file has glass or a PBR coat without `Ni`.
const DEFAULT_IOR: f64 = 1.5;

/// The core's material for what the file says, with views of the textures that it needs.
pub(super) fn resolve(mtl: &MtlMaterial, textures: &mut TextureSet, notes: &mut Notes) -> Material {
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

/// Scale and offset that all the maps of a material share, applied to its texture coordinates by the loader.
pub(super) fn texcoord_transform(mtl: &MtlMaterial, notes: &mut Notes) -> ([f64; 2], [f64; 2]) {
    const NONE: ([f64; 2], [f64; 2]) = ([1.0; 2], [0.0; 2]);
    let mut transforms = maps(mtl).map(|map| (map.options.scale, map.options.offset));
    let Some(first) = transforms.next() else { return NONE };
    if transforms.all(|other| other == first) {
        return first;
    }
    notes.add(1, format!("maps of material `{}` have different `-s` or `-o`: left out", mtl.name));
    NONE
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
    fn surface(&mut self) -> Surface {
        let mtl = self.mtl;
        let is_glass = matches!(mtl.illumination, Some(4 | 6 | 7 | 9));
        let metallic = self.metallic();
        let is_metal = metallic.texture.is_none() && metallic.value >= 1.0;
        let is_polished = is_metal && mtl.roughness == Some(0.0) && mtl.roughness_map.is_none();
        if is_glass {
            self.glass()
        } else if mtl.illumination == Some(3) || is_polished {
            let reflectance = if self.has_specular() { self.specular() } else { self.diffuse() };
            Surface::Mirror { reflectance }
        } else if mtl.illumination == Some(5) {
            // Mirror reflection with Fresnel's law: a metal without roughness.
            let reflectance = if self.has_specular() { self.specular() } else { self.diffuse() };
            Surface::Conductor { reflectance, roughness: 0.0.into() }
        } else if is_metal {
            let diffuse = self.diffuse();
            let reflectance =
                if is_black(&diffuse) && self.has_specular() { self.specular() } else { diffuse };
            Surface::Conductor { reflectance, roughness: self.roughness() }
        } else {
            self.coated(metallic)
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

    /// Diffuse, under a coat where there is one.
    fn coated(&mut self, metallic: ScalarInput) -> Surface {
        let base = self.diffuse();
        let is_pbr = self.mtl.roughness.is_some() || self.mtl.roughness_map.is_some() || metallic.value > 0.0;
        let (specular, ior) = if self.has_specular() {
            (self.specular(), self.plastic_ior())
        } else if is_pbr {
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
        (self.mtl.illumination == Some(2) && expected > 0.0 && agrees).then_some(ior as f32)
    }

    fn has_specular(&self) -> bool {
        self.mtl.specular.is_some() || self.mtl.specular_map.is_some()
    }

    fn specular(&mut self) -> ColorInput {
        let value = self.reflectance("Ks", self.mtl.specular.unwrap_or([1.0; 3]));
        ColorInput { value, texture: self.textures.colour(self.mtl.specular_map.as_ref()) }
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
        ColorInput { value: self.reflectance("Kd", mtl.diffuse.unwrap_or([absent; 3])), texture }
    }

    /// sqrt(alpha): `Pr`, else from `Ns` by alpha = sqrt(2 / (Ns + 2)).
    fn roughness(&mut self) -> ScalarInput {
        let mtl = self.mtl;
        let texture = self.textures.scalar(mtl.roughness_map.as_ref());
        let from_shininess = |ns: f64| (2.0 / (ns.max(0.0) + 2.0)).powf(0.25);
        let value = match (mtl.roughness, texture) {
            (Some(roughness), _) => roughness,
            (None, Some(_)) => 1.0,
            (None, None) => mtl.shininess.map_or(1.0, from_shininess),
        };
        ScalarInput { value: self.unit("Pr", value), texture }
    }

    fn metallic(&mut self) -> ScalarInput {
        let texture = self.textures.scalar(self.mtl.metallic_map.as_ref());
        let absent = if texture.is_some() { 1.0 } else { 0.0 };
        ScalarInput { value: self.unit("Pm", self.mtl.metallic.unwrap_or(absent)), texture }
    }

    fn emission(&mut self) -> ColorInput {
        let texture = self.textures.colour(self.mtl.emission_map.as_ref());
        let absent = if texture.is_some() { 1.0 } else { 0.0 };
        let value = self.mtl.emission.unwrap_or([absent; 3]);
        if value.iter().any(|&x| x < 0.0 || x > f64::from(f32::MAX)) {
            self.notes.add(1, format!("Ke of material `{}` is limited to what light can be", self.mtl.name));
        }
        let value = value.map(|x| x.clamp(0.0, f64::from(f32::MAX)) as f32).into();
        ColorInput { value, texture }
    }

    /// `d`; glass lets light through by refraction alone.
    fn opacity(&mut self) -> ScalarInput {
        let mtl = self.mtl;
        let texture = self.textures.opacity(mtl.opacity_map.as_ref());
        let is_glass = matches!(mtl.illumination, Some(4 | 6 | 7 | 9));
        let value = match mtl.opacity {
            Some(d) if is_glass && d < 1.0 => {
                self.notes
                    .add(1, "`d` of a glass (illum 4, 6, 7, 9) left out: it refracts, it is not cut out");
                1.0
            }
            Some(d) => self.unit("d", d),
            None => 1.0,
        };
        if value == 0.0 {
            self.notes.add(1, format!("material `{}` has opacity 0 and cannot be seen", mtl.name));
        }
        ScalarInput { value, texture }
    }

    fn normal_map(&mut self) -> Option<NormalMap> {
        let bump = self.mtl.bump_map.as_ref();
        let tangent = self.textures.data(self.mtl.normal_map.as_ref()).map(NormalMap::Tangent);
        tangent.or_else(|| {
            Some(NormalMap::Height(
                self.textures.data(bump)?,
                bump?.options.bump_multiplier.unwrap_or(1.0) as f32,
            ))
        })
    }

    /// `Ni`, where it can be one.
    fn ior(&mut self) -> Option<f64> {
        let ior = self.mtl.ior?;
        // The limits of the MTL specification, with room.
        let fine = (0.001..=100.0).contains(&ior);
        if !fine {
            self.notes.add(
                1,
                format!("Ni {ior} of material `{}` is no index of refraction: left out", self.mtl.name),
            );
        }
        fine.then_some(ior)
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
    fn glass() {
        let glass =
            |ior, roughness: f32| Surface::Dielectric { ior, tint: Rgb::ONE, roughness: roughness.into() };
        for model in [4, 6, 7, 9] {
            assert_eq!(
                surface(&format!("Kd 0 0 0\nKs 1 1 1\nNs 1e6\nNi 1.33\nillum {model}")),
                glass(1.33, 0.0)
            );
        }
        assert_eq!(surface("Ni 1\nPr 0.2\nillum 7"), glass(1.0, 0.2));
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
