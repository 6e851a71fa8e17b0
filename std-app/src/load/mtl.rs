//! MTL files, as their statements say them; [`super::surface`] decides what they mean. A statement that
//! cannot be read is left out with a note: a picture with one wrong material is better than none.

use super::map::Map;
use super::name::Name;
use super::notes::Notes;
use super::text::{self, Lines, Words, words};

/// A material as written. `None` where the file says nothing.
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
    /// Not in MTL: whether somebody calls it glass, who knows what that is.
    pub surely_glass: bool,
    /// Not in MTL: whether both sides emit.
    pub two_sided: bool,
    /// `map_Kd`.
    pub diffuse_map: Option<Map>,
    /// `map_Ks`.
    pub specular_map: Option<Map>,
    /// `map_Ke`.
    pub emission_map: Option<Map>,
    /// `map_Pr`.
    pub roughness_map: Option<Map>,
    /// `map_Pm`.
    pub metallic_map: Option<Map>,
    /// `map_d`.
    pub opacity_map: Option<Map>,
    /// `bump`, `map_bump`: heights.
    pub bump_map: Option<Map>,
    /// `norm`: tangent-space normals.
    pub normal_map: Option<Map>,
}

/// What an MTL file says.
#[derive(Clone, Debug, Default)]
pub struct Mtl {
    /// In the order of the file.
    pub materials: Vec<MtlMaterial>,
    /// What was left out.
    pub notes: Notes,
}

/// Reads the bytes of an MTL file; never fails. `file` is for messages only.
pub fn parse(bytes: Vec<u8>, file: &str) -> Mtl {
    let mut reader = Reader { materials: Vec::new(), opacity_by_d: false, notes: Notes::of(file) };
    match text::normalise(bytes) {
        Err(text::Binary) => reader.notes.at(0, "material library that is not text left out"),
        Ok(text) => Lines::new(&text, 1).for_each(|(number, line)| reader.line(number, line)),
    }
    Mtl { materials: reader.materials, notes: reader.notes }
}

struct Reader {
    materials: Vec<MtlMaterial>,
    opacity_by_d: bool,
    notes: Notes,
}

impl Reader {
    fn line(&mut self, line: u32, text: &[u8]) {
        let mut operands = words(text);
        let Some(keyword) = operands.next() else { return };
        let keyword = String::from_utf8_lossy(keyword).to_ascii_lowercase();
        if keyword == "newmtl" {
            let name = operands.rest().into();
            self.materials.push(MtlMaterial { name, ..MtlMaterial::default() });
            self.opacity_by_d = false;
            return;
        }
        let Self { materials, opacity_by_d, notes } = self;
        let Some(material) = materials.last_mut() else {
            return notes.at(line, "statement before the first `newmtl` left out");
        };
        let known = statement(material, opacity_by_d, &keyword, operands, line, notes);
        if !known {
            let short: String = keyword.chars().take(24).collect();
            notes.at(line, format!("material statement `{short}` is not supported: left out"));
        }
    }
}

/// Applies one statement; `false` where the keyword is not known.
fn statement(
    material: &mut MtlMaterial,
    opacity_by_d: &mut bool,
    keyword: &str,
    operands: Words,
    line: u32,
    notes: &mut Notes,
) -> bool {
    match keyword {
        "kd" => set(&mut material.diffuse, colour(operands, keyword, line, notes)),
        "ks" => set(&mut material.specular, colour(operands, keyword, line, notes)),
        "ke" => set(&mut material.emission, colour(operands, keyword, line, notes)),
        "tf" => set(&mut material.tint, colour(operands, keyword, line, notes)),
        "ns" => set(&mut material.shininess, scalar(operands, keyword, line, notes)),
        "ni" => set(&mut material.ior, scalar(operands, keyword, line, notes)),
        "pr" => set(&mut material.roughness, scalar(operands, keyword, line, notes)),
        "pm" => set(&mut material.metallic, scalar(operands, keyword, line, notes)),
        "d" => {
            let halo = operands.clone().next() == Some(b"-halo");
            if halo {
                notes.at(line, "`d -halo` is read as a plain opacity");
            }
            let opacity = scalar(operands.skip(usize::from(halo)), keyword, line, notes);
            *opacity_by_d |= opacity.is_some();
            set(&mut material.opacity, opacity);
        }
        // Some exporters write `Tr` as they write `d`: where both stand, `d` is believed.
        "tr" if *opacity_by_d => {}
        "tr" => set(&mut material.opacity, scalar(operands, keyword, line, notes).map(|tr| 1.0 - tr)),
        "illum" => {
            let model = scalar(operands, keyword, line, notes).filter(|model| (0.0..=10.0).contains(model));
            set(&mut material.illumination, model.map(|model| model as u32));
        }
        "map_kd" => set(&mut material.diffuse_map, map(operands, line, notes)),
        "map_ks" => set(&mut material.specular_map, map(operands, line, notes)),
        "map_ke" => set(&mut material.emission_map, map(operands, line, notes)),
        "map_pr" => set(&mut material.roughness_map, map(operands, line, notes)),
        "map_pm" => set(&mut material.metallic_map, map(operands, line, notes)),
        "map_d" => set(&mut material.opacity_map, map(operands, line, notes)),
        "bump" | "map_bump" => set(&mut material.bump_map, map(operands, line, notes)),
        "norm" | "map_kn" => set(&mut material.normal_map, map(operands, line, notes)),
        // Ambient light is computed, not invented; smoothing of maps is the renderer's.
        "ka" | "map_ka" | "sharpness" | "map_aat" => {}
        _ => return false,
    }
    true
}

/// A statement that could not be read leaves what an earlier one said.
fn set<T>(place: &mut Option<T>, value: Option<T>) {
    if value.is_some() {
        *place = value;
    }
}

/// `r g b`, or `r` alone for a grey.
fn colour<'a>(
    operands: impl Iterator<Item = &'a [u8]> + Clone,
    keyword: &str,
    line: u32,
    notes: &mut Notes,
) -> Option<[f64; 3]> {
    if matches!(operands.clone().next(), Some(b"spectral" | b"xyz")) {
        notes.at(line, "colour given as `spectral` or `xyz` is not supported: left out");
        return None;
    }
    let numbers: Option<Vec<f64>> = operands.take(3).map(text::number).collect();
    match numbers.as_deref() {
        Some(&[r, g, b]) => Some([r, g, b]),
        Some(&[grey]) => Some([grey; 3]),
        _ => unreadable(keyword, line, notes),
    }
}

fn scalar<'a>(
    mut operands: impl Iterator<Item = &'a [u8]>,
    keyword: &str,
    line: u32,
    notes: &mut Notes,
) -> Option<f64> {
    operands.next().and_then(text::number).or_else(|| unreadable(keyword, line, notes))
}

fn unreadable<T>(keyword: &str, line: u32, notes: &mut Notes) -> Option<T> {
    notes.at(line, format!("material statement `{keyword}` whose numbers cannot be read left out"));
    None
}

/// `[-option values]... file name with blanks`
fn map(operands: Words, line: u32, notes: &mut Notes) -> Option<Map> {
    let map = Map::of_statement(operands.rest(), line);
    if map.is_none() {
        notes.at(line, "map without a file name left out");
    }
    map
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(text: &str) -> (MtlMaterial, Vec<String>) {
        let mtl = parse(text.as_bytes().to_vec(), "m.mtl");
        (mtl.materials.last().cloned().unwrap_or_default(), mtl.notes.sentences())
    }

    #[test]
    fn values_and_comments() {
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
    fn opacity_in_its_spellings() {
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
        let map = material.diffuse_map.as_ref().unwrap();
        assert_eq!((map.operand.bytes(), map.line, &map.found), (&b"-s 2 2 gr\xfcn #1.png"[..], 2, &None));
        assert_eq!(mtl.notes.sentences(), ["map without a file name left out (m.mtl:3)"]);
    }

    #[test]
    fn what_cannot_be_read_is_left_out_and_said() {
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
