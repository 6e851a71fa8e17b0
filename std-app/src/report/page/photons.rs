//! What became of photons: in numbers, and as pictures of the last maps.

use super::map::Map;
use super::{fill, parts};
use crate::drive::{MapUse, MapView};
use crate::report::Run;
use crate::report::words::{grouped, readable_seconds};

/// The section of photons; nothing where the method has none and nobody looked for any.
pub(super) fn section(run: &Run) -> String {
    let caustics = run.result.caustics;
    if run.result.photons.is_none() && caustics.share.is_none() && !caustics.lacks_memory {
        return String::new();
    }
    let photons = run.result.photons.unwrap_or_default();
    let view = run.result.photon_view.as_ref();
    let mut facts = vec![("Maps", grouped(photons.maps))];
    if photons.maps > 0 {
        facts.push(("Shooting and building", readable_seconds(run.result.seconds.photons)));
    }
    if let Some(share) = caustics.share {
        facts.push(("Light that they bring, by a first look", parts::percent(share)));
    }
    let mut maps = String::new();
    let kinds = [
        (false, photons.global, view.and_then(|view| view.global.as_ref())),
        (true, photons.caustic, view.and_then(|view| view.caustic.as_ref())),
    ];
    let mut words = first_look(run).to_owned();
    if [photons.global, photons.caustic].into_iter().flatten().any(|map| map.by_power.is_some()) {
        words += "Lights, and where they shine, are chosen by what photons of a first look brought to what is visible, a part by \
                  power alone. ";
    }
    for (is_caustic, used, seen) in kinds {
        let Some(used) = used else { continue };
        facts.extend(numbers(is_caustic, &used, seen));
        let kind = if is_caustic { " of caustics" } else { "" };
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
    fill(
        include_str!("photons.html"),
        &[("facts", &parts::facts(&facts)), ("words", &words), ("maps", &maps)],
    )
}

/// What a first look for caustics has decided, where there was one.
fn first_look(run: &Run) -> &'static str {
    let caustics = run.result.caustics;
    match (caustics.used, caustics.share) {
        _ if caustics.lacks_memory => {
            "There was no memory to look for light that comes through mirrors or glass: where there is any, it is \
             missing or noisy. "
        }
        (true, _) => {
            "Paths, or records, have all other light, and paths share with photons what both find. Only photons \
             that count are kept: each is left with the probability that is its weight beside paths, most where paths find next to nothing. "
        }
        (false, Some(_)) => {
            "Photons of caustics were shot and thrown away: they bring too little light to pay for themselves, and paths \
             find that, too. "
        }
        _ => "",
    }
}

fn numbers(is_caustic: bool, used: &MapUse, seen: Option<&MapView>) -> Vec<(&'static str, String)> {
    let [shot, stored, useful, counting, by_power] = if is_caustic {
        [
            "Light paths for caustics",
            "Caustic photons left",
            "Caustic photons in direct sight",
            "Light paths for caustics that count for the picture, by a first look",
            "The same for caustics if the power of lights decided",
        ]
    } else {
        [
            "Light paths",
            "Photons left",
            "Photons in direct sight",
            "Light paths whose photons count for the picture, by a first look",
            "The same if the power of lights decided",
        ]
    };
    let mut facts = vec![(shot, grouped(used.shot)), (stored, grouped(used.stored))];
    let shares = [(useful, seen.map(|seen| seen.seen)), (counting, used.seen), (by_power, used.by_power)];
    facts.extend(shares.into_iter().filter_map(|(name, share)| Some((name, parts::percent(share?)))));
    facts
}

fn pictures(kind: &str, width: u32, seen: &MapView) -> String {
    let map = |values: &[f32]| Map { width, values: values.to_vec() };
    map(&seen.positions).figure(
        &format!("Photons{kind}"),
        "How many photons of the last map the camera sees in each pixel, but for those behind glass or in mirrors: where they \
         lie.",
    ) + &map(&seen.density).figure(
        &format!("Density of photons{kind}"),
        "Photons per square metre on the surface that a pixel sees, by the nearest 64 of them. Glass and mirrors hold none: \
         there it is that of what lies near.",
    ) + &map(&seen.radius).figure(
        &format!("Radius{kind}"),
        "How far those 64 reach, in metres: what an estimate from so many would blur.",
    )
}
