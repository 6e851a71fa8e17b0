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
    /// Not in MTL: both sides emit.
    pub two_sided: bool,
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
}

impl MtlMaterial {
    /// The map of a kind.
    pub fn map(&self, kind: MapKind) -> Option<&Map> {
        self.maps.get(&kind)
    }

    /// Whether there is a map of a kind.
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
        Statement { keyword: &keyword, operands, line, notes }.apply(material, &mut has_d);
    }
    mtl
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
            // Some exporters write `Tr` with the value of `d`, so `d` wins.
            "tr" if *has_d => {}
            "tr" => {
                let mut transparency = None;
                self.scalar(&mut transparency);
                material.opacity = transparency.map(|tr| 1.0 - tr).or(material.opacity);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn one(text: &str) -> (MtlMaterial, Vec<String>) {
        let mtl = parse(text.as_bytes().to_vec(), "m.mtl");
        (mtl.materials.last().cloned().unwrap_or_default(), mtl.notes.sentences())
    }

    #[test]
    fn values_and_comments_are_read() {
        let (material, notes) =
            one("newmtl red wall \n\tKd 0.63 0.065 0.05 # Red\nKs 0.4\nNs 10.0\r\nillum 2\nKe 1e1 2 3\n");
        assert_eq!(material.name, "red wall ".into());
        assert_eq!(material.diffuse, Some([0.63, 0.065, 0.05]));
        assert_eq!(material.specular, Some([0.4; 3]));
        assert_eq!((material.shininess, material.illumination), (Some(10.0), Some(2)));
        assert_eq!(material.emission, Some([10.0, 2.0, 3.0]));
        assert!(notes.is_empty());
    }

    #[test]
    fn d_wins_over_tr() {
        assert_eq!(one("newmtl a\nTr 0.25").0.opacity, Some(0.75));
        assert_eq!(one("newmtl a\nd 1\nTr 1").0.opacity, Some(1.0));
        assert_eq!(one("newmtl a\nTr 1\nd 1").0.opacity, Some(1.0));
        assert_eq!(one("newmtl a\nd -halo 0.5").0.opacity, Some(0.5));
    }

    #[test]
    fn maps_and_names_keep_their_bytes() {
        let mtl = parse(b"newmtl gr\xfcn #1\nmap_Kd -s 2 2 gr\xfcn #1.png\r\nbump".to_vec(), "m.mtl");
        let material = &mtl.materials[0];
        assert_eq!(material.name, b"gr\xfcn #1"[..].into());
        let map = &material.maps[&MapKind::Diffuse];
        assert_eq!((map.operand.bytes(), map.line, &map.found), (&b"-s 2 2 gr\xfcn #1.png"[..], 2, &None));
        assert_eq!(mtl.notes.sentences(), ["map without a file name left out (m.mtl:3)"]);
    }

    #[test]
    fn unreadable_statements_are_noted() {
        let (material, notes) =
            one("Kd 1 1 1\nnewmtl a\nKd spectral x.rfl\nNs abc\nPe 10\nPe 10\nKs 1 nan 1\nmap_Kd");
        assert_eq!(material, MtlMaterial { name: "a".into(), ..Default::default() });
        assert_eq!(
            notes,
            [
                "statement before the first `newmtl` left out (m.mtl:1)",
                "colour given as `spectral` or `xyz` is not supported: left out (m.mtl:3)",
                "material statement `ns` whose numbers cannot be read left out (m.mtl:4)",
                "material statement `pe` is not supported: left out, 2 times (first: m.mtl:5)",
                "material statement `ks` whose numbers cannot be read left out (m.mtl:7)",
                "map without a file name left out (m.mtl:8)",
            ]
        );
        assert_eq!(parse(vec![1, 0, 7, 0, 9, 0, 0, 0, 0], "m.mtl").materials, []);
    }
}
