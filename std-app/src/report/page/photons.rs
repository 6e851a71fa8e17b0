//! What became of photons: in numbers, and as pictures of the last maps.

use super::map::Map;
use super::{fill, parts};
use crate::drive::{MapUse, MapView};
use crate::report::Run;
use crate::report::words::{grouped, number, readable_seconds};

/// The section of photons; nothing where the method has none.
pub(super) fn section(run: &Run) -> String {
    let Some(photons) = &run.result.photons else { return String::new() };
    let view = run.result.photon_view.as_ref();
    let mut facts =
        vec![("Maps", grouped(photons.maps)), ("Shooting and building", readable_seconds(photons.seconds))];
    let mut maps = String::new();
    let kinds = [
        ("", Some(&photons.global), view.map(|view| &view.global)),
        (" of caustics", photons.caustic.as_ref(), view.and_then(|view| view.caustic.as_ref())),
    ];
    let mut words = String::new();
    for (kind, used, seen) in kinds {
        let Some(used) = used else { continue };
        facts.extend(numbers(kind, used, seen));
        if used.given < used.wanted {
            words += &format!(
                "There was memory for {} light paths of {} in a map{kind}: the picture has more noise for it. ",
                grouped(used.given),
                grouped(used.wanted)
            );
        }
        if let (Some(view), Some(seen)) = (view, seen) {
            maps += &pictures(kind, view.width, seen);
        }
    }
    let facts: Vec<(&str, String)> = facts.iter().map(|(name, value)| (&**name, value.clone())).collect();
    fill(
        include_str!("photons.html"),
        &[("facts", &parts::facts(&facts)), ("words", &words), ("maps", &maps)],
    )
}

fn numbers(kind: &'static str, used: &MapUse, seen: Option<&MapView>) -> Vec<(&'static str, String)> {
    let is_caustic = !kind.is_empty();
    let [shot, stored, useful] = if is_caustic {
        ["Light paths for caustics", "Caustic photons left", "Of those of the last map, seen by the camera"]
    } else {
        ["Light paths", "Photons left", "Of those of the last map, seen by the camera"]
    };
    let mut facts = vec![(shot, grouped(used.shot)), (stored, grouped(used.stored))];
    if let Some(seen) = seen {
        facts.push((useful, format!("{}&#8239;%", number(100.0 * seen.seen, 2))));
    }
    facts
}

fn pictures(kind: &str, width: u32, seen: &MapView) -> String {
    let map = |values: &[f32]| Map { width, values: values.to_vec() };
    map(&seen.positions).figure(
        &format!("Photons{kind}"),
        "How many photons of the last map the camera sees in each pixel: where they lie.",
    ) + &map(&seen.density).figure(
        &format!("Density of photons{kind}"),
        "Photons per square metre on the surface that a pixel sees, by the nearest 64 of them.",
    ) + &map(&seen.radius).figure(
        &format!("Radius{kind}"),
        "How far those 64 reach, in metres: what an estimate from so many would blur.",
    )
}
