//! Materials of glTF as statements of an MTL: metallic-roughness, and extensions that the core has surfaces
//! for. Statements are exact: no convention of an exporter of MTL applies to them.

use super::Source;
use super::accessor::Buffers;
use super::container;
use super::json::{self, Material, OfMaterial, TextureInfo};
use super::texcoords::{self, MapOfMaterial, Pair, transform_of};
use crate::load::bytes::Bytes;
use crate::load::error::LoadError;
use crate::load::files::Found;
use crate::load::map::{Channel, Map, MapOptions};
use crate::load::mtl::{MapKind, MtlMaterial};
use halflight_core::scene::{TextureEdge, Wrap};
use std::collections::HashMap;
use std::path::PathBuf;

/// Index of refraction without `KHR_materials_ior`.
const DEFAULT_IOR: f64 = 1.5;

/// Bytes of a material.
const MATERIAL: usize = 4096;

/// Materials in use, and their embedded pictures.
#[derive(Default)]
pub(super) struct Materials {
    /// By the index in the file; `None` for primitives without material.
    numbers: HashMap<Option<usize>, usize>,
    materials: Vec<MtlMaterial>,
    texcoords: Vec<(Pair, Option<Pair>)>,
    /// Input on which vertex colours are a factor, and true if their alpha is one on the opacity.
    colorable: Vec<(MapKind, bool)>,
    images: HashMap<usize, Option<PathBuf>>,
    pictures: HashMap<PathBuf, Bytes>,
}

impl Materials {
    /// The number of a material, which is read at its first use.
    pub(super) fn number(
        &mut self,
        buffers: &Buffers,
        index: Option<usize>,
        source: &mut Source,
    ) -> Result<usize, LoadError> {
        if let Some(&number) = self.numbers.get(&index) {
            return Ok(number);
        }
        let default = Material::default();
        let of_file = index.map(|index| {
            let missing = || buffers.error(format!("there is no material {index}"));
            buffers.document.materials.get(index).ok_or_else(missing)
        });
        let material = of_file.transpose()?.unwrap_or(&default);
        source.take(MATERIAL)?;
        let name = match (&material.name[..], index) {
            ("", None) => "default".into(),
            ("", Some(index)) => format!("material {index}"),
            (name, _) => name.into(),
        };
        let mut reader = Reader { materials: self, buffers, source, name, maps: Vec::new() };
        let mut mtl = reader.statements(material)?;
        let Reader { name, maps, source, .. } = reader;
        let texcoords = texcoords::applied(maps, &name, &mut mtl, source);
        mtl.name = name[..].into();
        let number = self.materials.len();
        self.numbers.insert(index, number);
        self.materials.push(mtl);
        self.texcoords.push(texcoords);
        let kind = if material.extensions.unlit.is_some() { MapKind::Emission } else { MapKind::Diffuse };
        self.colorable.push((kind, material.alpha_mode.as_deref() == Some("BLEND")));
        Ok(number)
    }

    /// Texture coordinates of a material.
    pub(super) fn texcoords(&self, number: usize) -> (Pair, Option<Pair>) {
        self.texcoords[number]
    }

    /// Makes vertex colours a factor on a material.
    pub(super) fn color(&mut self, number: usize, source: &mut Source) {
        let (mtl, (kind, is_blended)) = (&mut self.materials[number], self.colorable[number]);
        (mtl.vertex_color, mtl.vertex_alpha) = (Some(kind), is_blended);
        if mtl.pane || mtl.surely_glass {
            source.note("vertex colours of glass are left out");
        }
    }

    /// The materials, and the pictures by the names of their maps.
    pub(super) fn into_parts(self) -> (Vec<MtlMaterial>, HashMap<PathBuf, Bytes>) {
        (self.materials, self.pictures)
    }
}

/// A material under construction.
struct Reader<'a, 's> {
    materials: &'a mut Materials,
    buffers: &'a Buffers<'a>,
    source: &'a mut Source<'s>,
    name: String,
    maps: Vec<MapOfMaterial>,
}

impl Reader<'_, '_> {
    fn note(&mut self, what: &str) {
        let name = &self.name;
        self.source.notes.add(1, format!("material `{name}`: {what}"));
    }

    fn statements(&mut self, material: &Material) -> Result<MtlMaterial, LoadError> {
        let pbr = &material.pbr_metallic_roughness;
        let [r, g, b, alpha] = pbr.base_color_factor.unwrap_or([1.0; 4]);
        let mut mtl = MtlMaterial {
            diffuse: Some([r, g, b]),
            metallic: Some(pbr.metallic_factor.unwrap_or(1.0)),
            roughness: Some(pbr.roughness_factor.unwrap_or(1.0)),
            ior: Some(DEFAULT_IOR),
            two_sided: material.double_sided,
            exact: true,
            ..MtlMaterial::default()
        };
        self.map(MapKind::Diffuse, pbr.base_color_texture.as_ref(), None)?;
        let metallic_roughness = pbr.metallic_roughness_texture.as_ref();
        self.map(MapKind::Roughness, metallic_roughness, Some(1))?;
        if mtl.metallic != Some(0.0) {
            self.map(MapKind::Metallic, metallic_roughness, Some(2))?;
        }
        self.map(MapKind::Normal, material.normal_texture.as_ref(), None)?;
        if material.emissive_factor != [0.0; 3] {
            let strength = material.extensions.emissive.as_ref().and_then(|of| of.emissive_strength);
            mtl.emission = Some(material.emissive_factor.map(|channel| channel * strength.unwrap_or(1.0)));
            self.map(MapKind::Emission, material.emissive_texture.as_ref(), None)?;
        }
        self.extensions(&material.extensions, &mut mtl)?;
        self.alpha(material, alpha, &mut mtl)?;
        Ok(mtl)
    }

    /// Opacity by the alpha mode.
    fn alpha(&mut self, material: &Material, alpha: f64, mtl: &mut MtlMaterial) -> Result<(), LoadError> {
        let texture = material.pbr_metallic_roughness.base_color_texture.as_ref();
        match material.alpha_mode.as_deref() {
            None | Some("OPAQUE") => {}
            Some("BLEND") => {
                mtl.opacity = Some(alpha);
                self.map(MapKind::Opacity, texture, Some(3))?;
            }
            Some("MASK") => {
                let cutoff = material.alpha_cutoff.unwrap_or(0.5);
                if texture.is_some() && alpha > 0.0 {
                    mtl.opacity = Some(1.0);
                    self.map(MapKind::Opacity, texture, Some(3))?;
                    let mask = self.maps.last_mut().filter(|map| map.kind == MapKind::Opacity);
                    mask.into_iter().for_each(|mask| mask.map.options.threshold = Some(cutoff / alpha));
                } else {
                    mtl.opacity = Some(if alpha >= cutoff { 1.0 } else { 0.0 });
                }
            }
            Some(_) => self.note("unknown `alphaMode`: it is opaque"),
        }
        Ok(())
    }

    fn extensions(&mut self, extensions: &OfMaterial, mtl: &mut MtlMaterial) -> Result<(), LoadError> {
        let ior = extensions.ior.as_ref().and_then(|of| of.ior).unwrap_or(DEFAULT_IOR);
        mtl.ior = Some(ior);
        if let Some(specular) = &extensions.specular {
            let level = specular.specular_factor.unwrap_or(1.0) * ((ior - 1.0) / (ior + 1.0)).powi(2);
            let color = specular.specular_color_factor.unwrap_or([1.0; 3]);
            mtl.specular = Some(color.map(|channel| (channel * level).clamp(0.0, 1.0)));
            if level > 0.0 {
                self.map(MapKind::SpecularLevel, specular.specular_texture.as_ref(), Some(3))?;
                self.map(MapKind::Specular, specular.specular_color_texture.as_ref(), None)?;
            }
        }
        if let Some(coat) = extensions.clearcoat.as_ref().filter(|coat| coat.clearcoat_factor > 0.0) {
            self.clearcoat(coat, mtl)?;
        }
        if extensions.unlit.is_some() {
            self.note("is unlit: its colour is its emission");
            mtl.emission = mtl.diffuse.replace([0.0; 3]);
            mtl.specular = Some([0.0; 3]);
            mtl.metallic = Some(0.0);
            self.maps.retain(|map| map.kind == MapKind::Diffuse);
            self.maps.iter_mut().for_each(|map| map.kind = MapKind::Emission);
        }
        if let Some(transmission) = extensions.transmission.as_ref().filter(|of| of.transmission_factor > 0.0)
        {
            self.transmission(transmission, extensions, mtl);
        }
        Ok(())
    }

    /// A coat has one roughness: that of the clear coat and the highlight below it over a diffuse base, and a
    /// metal's own.
    fn clearcoat(&mut self, coat: &json::Clearcoat, mtl: &mut MtlMaterial) -> Result<(), LoadError> {
        if mtl.metallic != Some(0.0) {
            self.note("a clear coat over metal is not supported: left out");
            return Ok(());
        }
        let level = 0.04 * coat.clearcoat_factor.min(1.0);
        let below = mtl.specular.unwrap_or([0.0; 3]);
        mtl.specular = Some(below.map(|channel| channel.max(level)));
        mtl.coat = Some([coat.clearcoat_factor, coat.clearcoat_roughness_factor]);
        self.map(MapKind::Coat, coat.clearcoat_texture.as_ref(), Some(0))?;
        self.map(MapKind::CoatRoughness, coat.clearcoat_roughness_texture.as_ref(), Some(1))?;
        if coat.clearcoat_normal_texture.is_some() {
            self.note("the normals of its clear coat are those of its base");
        }
        self.note("its clear coat and the highlight below it are one, of their mean roughness");
        Ok(())
    }

    /// Solid glass with a volume, else a thin pane.
    fn transmission(
        &mut self,
        transmission: &json::Transmission,
        extensions: &OfMaterial,
        mtl: &mut MtlMaterial,
    ) {
        let part = transmission.transmission_factor;
        if mtl.metallic.is_some_and(|metallic| metallic >= 1.0)
            && self.maps.iter().all(|map| map.kind != MapKind::Metallic)
        {
            return self.note("is metal and transmits nothing");
        }
        if transmission.transmission_texture.is_some() {
            self.note("`transmissionTexture` is not supported: left out");
        }
        if part < 0.5 {
            return self.note(&format!("transmits {part} of the light: it is opaque"));
        }
        if part < 1.0 {
            self.note(&format!("transmits {part} of the light: it is clear"));
        }
        let color = mtl.diffuse.unwrap_or([1.0; 3]);
        let has_texture = self.maps.iter().any(|map| map.kind == MapKind::Diffuse);
        self.maps.retain(|map| matches!(map.kind, MapKind::Roughness | MapKind::Normal | MapKind::Emission));
        if has_texture {
            self.note("the texture of the colour of its glass is left out");
        }
        (mtl.diffuse, mtl.metallic, mtl.specular) = (None, None, None);
        match extensions.volume.as_ref().filter(|volume| volume.thickness_factor > 0.0) {
            Some(volume) => {
                // Light crosses two boundaries, each with the square root of the colour.
                let absorbed = attenuation(volume);
                let tint = core::array::from_fn(|i| (color[i] * absorbed[i]).max(0.0).sqrt());
                (mtl.illumination, mtl.surely_glass, mtl.tint) = (Some(7), true, Some(tint));
            }
            None => {
                if mtl.roughness != Some(0.0) {
                    self.note("its pane is smooth: the roughness is left out");
                }
                (mtl.pane, mtl.tint) = (true, Some(color));
            }
        }
    }

    /// Adds a map by a texture.
    fn map(
        &mut self,
        kind: MapKind,
        info: Option<&TextureInfo>,
        channel: Option<u8>,
    ) -> Result<(), LoadError> {
        let Some(info) = info else { return Ok(()) };
        let document = self.buffers.document;
        let Some(texture) = document.textures.get(info.index) else {
            self.note(&format!("texture {} does not exist: constant value", info.index));
            return Ok(());
        };
        let image = texture.extensions.webp.as_ref().map(|webp| webp.source).or(texture.source);
        let Some(image) = image else {
            let what = match texture.extensions.basisu {
                Some(_) => "texture in `KHR_texture_basisu` is not supported: constant value",
                None => "texture without an image: constant value",
            };
            self.note(what);
            return Ok(());
        };
        let Some(found) = self.image(image)? else { return Ok(()) };
        let mut options = MapOptions { channel: channel.map(Channel::Component), ..MapOptions::default() };
        let sampler = texture.sampler.and_then(|sampler| document.samplers.get(sampler));
        let (s, t) = sampler.map_or((None, None), |sampler| (sampler.wrap_s, sampler.wrap_t));
        options.wrap = Wrap([s, t].map(|side| match side {
            Some(CLAMP) => TextureEdge::Clamp,
            Some(MIRROR) => TextureEdge::Mirror,
            _ => TextureEdge::Repeat,
        }));
        if kind == MapKind::Normal {
            options.bump_multiplier = info.scale;
        }
        let (set, transform) = transform_of(info);
        let name = found.display().to_string();
        let map = Map { options, ..Map::of_file(&name, found) };
        self.maps.push(MapOfMaterial { kind, map, set, transform });
        Ok(())
    }

    /// The file of an image, or the name of an embedded one; `None` with a note if there is none.
    fn image(&mut self, number: usize) -> Result<Option<PathBuf>, LoadError> {
        if let Some(known) = self.materials.images.get(&number) {
            return Ok(known.clone());
        }
        let found = match self.located(number)? {
            Ok(found) => Some(found),
            Err(why) => {
                self.source.note(format!("image {number} {why}: constant value"));
                None
            }
        };
        self.materials.images.insert(number, found.clone());
        Ok(found)
    }

    fn located(&mut self, number: usize) -> Result<Result<PathBuf, String>, LoadError> {
        let Some(image) = self.buffers.document.images.get(number) else {
            return Ok(Err("does not exist".into()));
        };
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) if container::data_uri(uri).is_some() => self.source.bytes(uri)?,
            (Some(uri), _) => {
                let found = self.source.locate(uri);
                return Ok(match found {
                    Found::Exact(file, _) | Found::Instead(file, _) => Ok(file),
                    found => Err(super::reason(&found, uri)),
                });
            }
            (None, Some(view)) => self.buffers.view(view).map(|(bytes, _)| bytes),
            (None, None) => Err("has no bytes".into()),
        };
        Ok(bytes.map(|bytes| {
            let short: String = image.name.chars().filter(|c| !c.is_control()).take(64).collect();
            let name = PathBuf::from(format!("{}#image {number} {short}", self.source.file.display()).trim());
            self.materials.pictures.insert(name.clone(), bytes);
            name
        }))
    }
}

/// Values of `wrapS` and `wrapT` other than the default, which repeats.
const CLAMP: u32 = 33071;
const MIRROR: u32 = 33648;

/// Transmittance of a volume along its thickness.
fn attenuation(volume: &json::Volume) -> [f64; 3] {
    let color = volume.attenuation_color.unwrap_or([1.0; 3]);
    match volume.attenuation_distance.filter(|distance| *distance > 0.0) {
        Some(distance) => {
            color.map(|channel| channel.clamp(0.0, 1.0).powf(volume.thickness_factor / distance))
        }
        None => [1.0; 3],
    }
}
