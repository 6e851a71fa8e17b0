//! Choice of the colour channels of an EXR. The name of a channel may start with a layer, as in `beauty.R`.

/// Last part of the name of the main layer, the likeliest first.
const MAIN: [&str; 6] = ["combined", "beauty", "rgba", "rgb", "color", "main"];

/// Indices of channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Choice {
    /// The part of the file.
    pub(super) part: usize,
    /// Red, green, blue.
    pub(super) colour: [usize; 3],
    /// Opacity.
    pub(super) alpha: Option<usize>,
}

/// A possible choice.
struct Candidate {
    choice: Choice,
    layer: String,
    /// The lowest rank is chosen.
    rank: usize,
}

/// The channels of the picture, and their layer if there are other candidates. `parts`: names of the channels
/// of each part. In this order: R, G and B without a layer, in one; Y without a layer, in one; a single
/// channel.
pub(super) fn choose(parts: &[Vec<String>]) -> Option<(Choice, Option<String>)> {
    let mut candidates: Vec<Candidate> =
        parts.iter().enumerate().flat_map(|(part, names)| candidates(part, names)).collect();
    // The sort is stable: the first in the file wins.
    candidates.sort_by_key(|candidate| candidate.rank);
    let others = candidates.len() > 1;
    let Candidate { choice, layer, .. } = candidates.into_iter().next()?;
    Some((choice, (others && !layer.is_empty()).then_some(layer)))
}

fn candidates(part: usize, names: &[String]) -> Vec<Candidate> {
    let split = |name: &str| match name.rsplit_once('.') {
        Some((layer, component)) => (layer.to_string(), component.to_ascii_lowercase()),
        None => (String::new(), name.to_ascii_lowercase()),
    };
    let split: Vec<(String, String)> = names.iter().map(|name| split(name)).collect();
    let mut layers: Vec<&String> = Vec::new();
    for (layer, _) in &split {
        if !layers.contains(&layer) {
            layers.push(layer);
        }
    }
    let mut found = Vec::new();
    for layer in layers {
        let channel = |names: &[&str]| {
            split.iter().position(|(of, component)| of == layer && names.contains(&component.as_str()))
        };
        let alpha = channel(&["a", "alpha"]);
        let last = layer.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        let rank = match layer.is_empty() {
            true => 0,
            false => 1 + MAIN.iter().position(|name| *name == last).unwrap_or(MAIN.len()),
        };
        let rgb = [channel(&["r", "red"]), channel(&["g", "green"]), channel(&["b", "blue"])];
        let others = || split.iter().enumerate().filter(|&(at, (of, _))| of == layer && Some(at) != alpha);
        let (colour, rank) = if let [Some(r), Some(g), Some(b)] = rgb {
            ([r, g, b], rank)
        } else if let Some(y) = channel(&["y"]) {
            ([y; 3], 100 + rank)
        } else if let (1, Some((only, _))) = (others().count(), others().next()) {
            ([only; 3], 200 + rank)
        } else {
            continue;
        };
        found.push(Candidate { choice: Choice { part, colour, alpha }, layer: layer.clone(), rank });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(parts: &[&[&str]]) -> Option<(Choice, Option<String>)> {
        let parts: Vec<Vec<String>> =
            parts.iter().map(|names| names.iter().map(|name| name.to_string()).collect()).collect();
        choose(&parts)
    }

    #[test]
    fn picture_among_layers_and_parts() {
        let at = |part, colour, alpha| Choice { part, colour, alpha };
        assert_eq!(chosen(&[&["A", "B", "G", "R"]]), Some((at(0, [3, 2, 1], Some(0)), None)));
        assert_eq!(chosen(&[&["Y"]]), Some((at(0, [0; 3], None), None)));
        assert_eq!(chosen(&[&["A", "Y"]]), Some((at(0, [1; 3], Some(0)), None)));
        assert_eq!(chosen(&[&["Z"], &["B", "G", "R"]]), Some((at(1, [2, 1, 0], None), None)));
        assert_eq!(
            chosen(&[&["albedo.B", "albedo.G", "albedo.R", "beauty.A", "beauty.B", "beauty.G", "beauty.R"]]),
            Some((at(0, [6, 5, 4], Some(3)), Some("beauty".into())))
        );
        assert_eq!(
            chosen(&[&["ViewLayer.Combined.B", "ViewLayer.Combined.G", "ViewLayer.Combined.R"]]),
            Some((at(0, [2, 1, 0], None), None))
        );
        assert_eq!(chosen(&[&["main.blue", "main.green", "main.red"]]), Some((at(0, [2, 1, 0], None), None)));
        assert_eq!(chosen(&[&["roughness"]]), Some((at(0, [0; 3], None), None)));
        assert_eq!(chosen(&[&["G", "R"]]), None);
        assert_eq!(chosen(&[]), None);
    }
}
