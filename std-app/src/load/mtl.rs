//! MTL files: statements as written; [`super::surface`] gives them their meaning. An unreadable statement is
//! left out with a note.

use super::map::Map;
use super::name::Name;
use super::notes::Notes;
use super::text::{self, Lines, Words, words};
use std::collections::BTreeMap;

/// A material as written; `None` for absent statements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlMaterial {
    /// `newmtl`: all that follows the keyword.
    pub name: Name,
    /// `Kd`: diffuse reflectance.
    pub diffuse: Option<[f64; 3]>,
    /// `Ks`: reflectance at normal incidence.
    pub specular: Option<[f64; 3]>,
    /// `Ke`: emitted radiance.
    pub emission: Option<[f64; 3]>,
    /// `Tf`: factor on transmitted light.
    pub tint: Option<[f64; 3]>,
    /// `Ns`: Phong exponent.
    pub shininess: Option<f64>,
    /// `Ni`: index of refraction.
    pub ior: Option<f64>,
    /// `d`, or 1 - `Tr`: opacity.
    pub opacity: Option<f64>,
    /// `Pr`: sqrt(GGX alpha).
    pub roughness: Option<f64>,
    /// `Pm`.
    pub metallic: Option<f64>,
    /// `illum`.
    pub illumination: Option<u32>,
    /// Not in MTL: the scene file specifies glass, whatever the other statements suggest.
    pub surely_glass: bool,
    /// Not in MTL: a scene file or glTF specifies a thin pane of index `Ni` and colour `Tf`.
    pub pane: bool,
    /// Not in MTL: the scene file specifies `Ks`, which is a reflectance.
    pub surely_reflects: bool,
    /// Not in MTL: a glTF file specifies metallic-roughness, and no convention of MTL applies.
    pub exact: bool,
    /// Not in MTL: both sides emit.
    pub two_sided: bool,
    /// Not in MTL: weight and sqrt(alpha) of a clear coat.
    pub coat: Option<[f64; 2]>,
    /// Not in MTL: vertex colours are a factor on the input of this map.
    pub vertex_color: Option<MapKind>,
    /// Not in MTL: the alpha of vertex colours is a factor on `d`.
    pub vertex_alpha: bool,
    /// Texture statements.
    pub maps: BTreeMap<MapKind, Map>,
}

/// The statement of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MapKind {
    /// `map_Kd`.
    Diffuse,
    /// `map_Ks`.
    Specular,
    /// `map_Ke`.
    Emission,
    /// `map_Pr`.
    Roughness,
    /// `map_Pm`.
    Metallic,
    /// `map_d`.
    Opacity,
    /// `bump`, `map_bump`: heights.
    Bump,
    /// `norm`, `map_Kn`: tangent-space normals.
    Normal,
    /// Not in MTL: alpha is a factor on `Ks`.
    SpecularLevel,
    /// Not in MTL: red is a factor on the weight of a clear coat.
    Coat,
    /// Not in MTL: green is a factor on the roughness of a clear coat.
    CoatRoughness,
}

impl MtlMaterial {
    /// The map of a kind.
    pub fn map(&self, kind: MapKind) -> Option<&Map> {
        self.maps.get(&kind)
    }

    /// True if there is a map of a kind.
    pub fn has_map(&self, kind: MapKind) -> bool {
        self.maps.contains_key(&kind)
    }
}

/// Content of an MTL file.
#[derive(Clone, Debug, Default)]
pub struct Mtl {
    /// Materials in the order of the file.
    pub materials: Vec<MtlMaterial>,
    /// Statements that were left out.
    pub notes: Notes,
}

/// Reads the bytes of an MTL file; never fails. `file` is for messages only.
pub fn parse(bytes: Vec<u8>, file: &str) -> Mtl {
    let mut mtl = Mtl { materials: Vec::new(), notes: Notes::of(file) };
    let Ok(text) = text::normalise(bytes) else {
        mtl.notes.at(0, "material library that is not text left out");
        return mtl;
    };
    let mut transparencies: Vec<Transparency> = Vec::new();
    let mut has_d = false;
    for (line, text) in Lines::new(&text, 1) {
        let mut operands = words(text);
        let Some(keyword) = operands.next() else { continue };
        let keyword = String::from_utf8_lossy(keyword).to_ascii_lowercase();
        if keyword == "newmtl" {
            let name = operands.rest().into();
            mtl.materials.push(MtlMaterial { name, ..MtlMaterial::default() });
            has_d = false;
            continue;
        }
        let notes = &mut mtl.notes;
        let Some(material) = mtl.materials.last_mut() else {
            notes.at(line, "statement before the first `newmtl` left out");
            continue;
        };
        let mut statement = Statement { keyword: &keyword, operands, line, notes };
        if keyword == "tr" {
            let mut value = None;
            statement.scalar(&mut value);
            let material = mtl.materials.len() - 1;
            // Some exporters write `Tr` with the value of `d`, so `d` wins.
            transparencies.extend(value.filter(|_| !has_d).map(|value| Transparency {
                material,
                line,
                value,
            }));
        } else {
            statement.apply(material, &mut has_d);
            if has_d {
                while transparencies.pop_if(|last| last.material + 1 == mtl.materials.len()).is_some() {}
            }
        }
    }
    apply_transparencies(&transparencies, &mut mtl);
    mtl
}

/// A `Tr` of a material without `d`.
struct Transparency {
    /// Index of the material.
    material: usize,
    line: u32,
    value: f64,
}

/// Sets opacities by `Tr`, which is 1 - `d` in most programs and `d` in others, such as MeshLab. Nobody
/// writes surfaces that are all invisible: a file means `d` if some `Tr` is 1 and none is 0, and a textured
/// surface is visible in any case.
fn apply_transparencies(transparencies: &[Transparency], mtl: &mut Mtl) {
    let Mtl { materials, notes } = mtl;
    // The opacity of glass has no effect.
    let counts = |of: &&Transparency| !matches!(materials[of.material].illumination, Some(4 | 6 | 7 | 9));
    let mut values = transparencies.iter().filter(counts).map(|of| of.value);
    let means_opacity = values.clone().any(|tr| tr >= 1.0) && !values.any(|tr| tr <= 0.0);
    for Transparency { material, line, value } in transparencies {
        let material = &mut materials[*material];
        let is_hidden = *value >= 1.0 && material.has_map(MapKind::Diffuse);
        let (opacity, note) = match (means_opacity, is_hidden) {
            (true, _) => (*value, Some("`Tr` is read as `d`: as 1 - `d`, a material would be invisible")),
            (false, true) => (1.0, Some("`Tr 1` left out: it would hide a texture")),
            (false, false) => (1.0 - value, None),
        };
        material.opacity = Some(opacity);
        note.into_iter().for_each(|note| notes.at(*line, note));
    }
}

struct Statement<'a> {
    keyword: &'a str,
    operands: Words<'a>,
    line: u32,
    notes: &'a mut Notes,
}

impl Statement<'_> {
    /// Sets the value of the statement. `has_d`: a `d` precedes it.
    fn apply(mut self, material: &mut MtlMaterial, has_d: &mut bool) {
        match self.keyword {
            "kd" => self.colour(&mut material.diffuse),
            "ks" => self.colour(&mut material.specular),
            "ke" => self.colour(&mut material.emission),
            "tf" => self.colour(&mut material.tint),
            "ns" => self.scalar(&mut material.shininess),
            "ni" => self.scalar(&mut material.ior),
            "pr" => self.scalar(&mut material.roughness),
            "pm" => self.scalar(&mut material.metallic),
            "d" => {
                let mut rest = self.operands.clone();
                if rest.next() == Some(b"-halo") {
                    self.operands = rest;
                    self.notes.at(self.line, "`d -halo` is read as a plain opacity");
                }
                let mut opacity = None;
                self.scalar(&mut opacity);
                *has_d |= opacity.is_some();
                material.opacity = opacity.or(material.opacity);
            }
            "illum" => {
                let mut model = None;
                self.scalar(&mut model);
                let model = model.filter(|model| (0.0..=10.0).contains(model)).map(|model| model as u32);
                material.illumination = model.or(material.illumination);
            }
            "map_kd" => self.map(material, MapKind::Diffuse),
            "map_ks" => self.map(material, MapKind::Specular),
            "map_ke" => self.map(material, MapKind::Emission),
            "map_pr" => self.map(material, MapKind::Roughness),
            "map_pm" => self.map(material, MapKind::Metallic),
            "map_d" => self.map(material, MapKind::Opacity),
            "bump" | "map_bump" => self.map(material, MapKind::Bump),
            "norm" | "map_kn" => self.map(material, MapKind::Normal),
            // Ambient light is computed, and maps are filtered by the renderer.
            "ka" | "map_ka" | "sharpness" | "map_aat" => {}
            keyword => {
                let short: String = keyword.chars().take(24).collect();
                self.notes.at(self.line, format!("material statement `{short}` is not supported: left out"));
            }
        }
    }

    /// Sets `r g b`, or `r` for a grey.
    fn colour(&mut self, value: &mut Option<[f64; 3]>) {
        if matches!(self.operands.clone().next(), Some(b"spectral" | b"xyz")) {
            return self
                .notes
                .at(self.line, "colour given as `spectral` or `xyz` is not supported: left out");
        }
        let numbers: Option<Vec<f64>> = self.operands.clone().take(3).map(text::number).collect();
        match numbers.as_deref() {
            Some(&[r, g, b]) => *value = Some([r, g, b]),
            Some(&[grey]) => *value = Some([grey; 3]),
            _ => self.unreadable(),
        }
    }

    fn scalar(&mut self, value: &mut Option<f64>) {
        match self.operands.next().and_then(text::number) {
            Some(number) => *value = Some(number),
            None => self.unreadable(),
        }
    }

    fn unreadable(&mut self) {
        let what = format!("material statement `{}` whose numbers cannot be read left out", self.keyword);
        self.notes.at(self.line, what);
    }

    /// Sets `[-option values]... file name with blanks`.
    fn map(self, material: &mut MtlMaterial, kind: MapKind) {
        match Map::of_statement(self.operands.rest(), self.line) {
            Some(map) => drop(material.maps.insert(kind, map)),
            None => self.notes.at(self.line, "map without a file name left out"),
        }
    }
}
