//! Reports in a real browser: an empty console, names that stay text, values and errors at the pointer, zooms
//! and flips. Skipped with a message without Chromium.

use crate::browser::{self, Folder, browser, noted, numbers, opened};
use core::sync::atomic::AtomicBool;
use halflight::compare::compare;
use halflight::load::{self, LoadOptions, LoadedScene};
use halflight::render::{Method, RejectedTile, RenderResult, Settings, Stop, render};
use halflight::report::{Provenance, Race, RaceEntry, Run};
use halflight::save::to_srgb;
use halflight_core::film::Dropped;
use halflight_tests::render::raw;
use std::sync::Arc;

/// A scene name that shows in the console unless it is escaped.
const EVIL: &str =
    "<script>console.error('name')</script>\"'><img src=x onerror=console.error(1)>{{body}}.obj";

/// Tolerance of display values, which the page looks up by a root: one, and one by rounding.
const TOLERANCE: f32 = 2.0;

/// Relative tolerance of radiance: three digits.
const DIGITS: f32 = 0.006;

/// Relative tolerance of errors: two digits, and mantissas of six bits.
const ERROR_DIGITS: f32 = 0.07;

/// Pixel that the test reads.
const PIXEL: [u32; 2] = [11, 7];

const SIZE: u32 = 24;

fn cornell() -> LoadedScene {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/cornell/cornell.obj");
    load::load(path.as_ref(), &LoadOptions::default()).unwrap()
}

fn picture(loaded: &LoadedScene, settings: &Settings) -> RenderResult {
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    render(&scene, settings, &mut |_| (), &AtomicBool::new(false)).unwrap()
}

/// Settings of 64 samples, against a reference of 256 with another seed.
fn settings(loaded: &LoadedScene, seed: u32) -> Settings {
    let stop = |spp| Stop { spp: Some(spp), ..Stop::default() };
    let (method, stop_at) = (Some(Method::Path), stop(64));
    let base = Settings { method, width: SIZE, height: SIZE, seed, stop: stop_at, ..raw() };
    let reference = picture(loaded, &Settings { seed: seed + 9, stop: stop(256), ..base.clone() }).image;
    Settings { reference: Some(Arc::new(reference)), ..base }
}

fn run_page(loaded: &LoadedScene, settings: &Settings, result: &RenderResult) -> String {
    let views = loaded.views();
    let command = vec!["halflight".into(), EVIL.into()];
    let provenance = Provenance { command, ..Provenance::here() };
    let comparison = compare(&result.image, settings.reference.as_ref().unwrap()).unwrap();
    let run = Run {
        scene: &views.scene(loaded.camera_or_default()),
        name: EVIL,
        repairs: &[EVIL.into()],
        settings,
        result,
        comparison: Some(&comparison),
        outputs: &[],
        load_seconds: 0.1,
        total_seconds: 1.0,
        provenance: &provenance,
    };
    index(run.files())
}

fn race_page(loaded: &LoadedScene, settings: &Settings, result: &RenderResult) -> String {
    race_page_of(loaded, settings, [result, result])
}

/// Page of a race of two methods with these results.
fn race_page_of(loaded: &LoadedScene, settings: &Settings, results: [&RenderResult; 2]) -> String {
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    let provenance = Provenance::here();
    let entry = |name: &str, result| RaceEntry {
        name: name.into(),
        run: Run {
            scene: &scene,
            name: EVIL,
            repairs: &[],
            settings,
            result,
            comparison: None,
            outputs: &[],
            load_seconds: 0.1,
            total_seconds: 1.0,
            provenance: &provenance,
        },
    };
    let entries = vec![entry("path", results[0]), entry(EVIL, results[1])];
    let race = Race { entries, seconds: 1.0, provenance: &provenance };
    index(race.files())
}

fn index(files: halflight::report::Files) -> String {
    let (_, page) = files.into_iter().find(|(name, _)| *name == "index.html").unwrap();
    String::from_utf8(page).unwrap()
}

fn probe(script: &str) -> String {
    browser::probe(SIZE, PIXEL, script)
}

/// Standard errors of a pixel: variances averaged twice over 3 × 3 pixels.
fn smoothed_errors(result: &RenderResult, [x, y]: [u32; 2]) -> [f32; 3] {
    let near = |at: u32| at.saturating_sub(1)..(at + 2).min(SIZE);
    let mean = |of: &dyn Fn(u32, u32) -> f32, [x, y]: [u32; 2]| {
        let square: Vec<f32> = near(y).flat_map(|y| near(x).map(move |x| of(x, y))).collect();
        square.iter().sum::<f32>() / square.len() as f32
    };
    [0, 1, 2].map(|channel: usize| {
        let variance = |x: u32, y: u32| result.variance.pixels[(y * SIZE + x) as usize][channel];
        mean(&|x, y| mean(&variance, [x, y]), [x, y]).sqrt()
    })
}

#[test]
fn pages_open_in_a_browser_without_an_error() {
    let Some((browser, folder)) = browser().zip(Some(Folder::new("open"))) else { return };
    let loaded = cornell();
    let settings = settings(&loaded, 1);
    let result = picture(&loaded, &settings);
    let page = run_page(&loaded, &settings, &result);
    let (console, _) = opened(browser, &folder.0, &page, "console.error('heard')");
    assert!(matches!(console.as_slice(), [one] if one.contains("heard")), "{console:?}");

    let (console, document) = opened(browser, &folder.0, &page, &probe("note('title', document.title);"));
    assert!(console.is_empty(), "{console:?}");
    assert_eq!(noted(&document, "done"), "yes");
    for words in
        ["<h1 id=\"heading\">&lt;script&gt;console.error('name')&lt;/script&gt;", "\"'\\''&gt;&lt;img"]
    {
        assert!(document.contains(words), "names are text: {words}");
    }
    for title in
        ["Standard error", "Relative difference", "FLIP", "Error against run time", "emissive", "relMSE of"]
    {
        assert!(document.contains(title), "{title}");
    }
    let race = race_page(&loaded, &settings, &result);
    let (console, document) = opened(browser, &folder.0, &race, &probe(""));
    assert!(console.is_empty(), "{console:?}");
    assert!(document.contains("a race of 2 methods") && document.contains("Leaders"));
}

#[test]
fn the_pointer_reads_values_and_errors_of_all_pictures() {
    let Some((browser, folder)) = browser().zip(Some(Folder::new("pointer"))) else { return };
    let loaded = cornell();
    let settings = settings(&loaded, 1);
    let result = picture(&loaded, &settings);
    let reads = "view.dispatchEvent(pointer('pointermove'));
        note('pixel', document.querySelector('#pixel').textContent);
        note('values', values());
        note('map', all('#maps .value')[0].textContent);
        const slider = document.querySelector('#exposure input');
        note('stops', slider.value);
        slider.value = 1;
        slider.dispatchEvent(new Event('input'));
        note('colour', colour());";
    let page = run_page(&loaded, &settings, &result);
    let (console, document) = opened(browser, &folder.0, &page, &probe(reads));
    assert!(console.is_empty(), "{console:?}");
    let [x, y] = PIXEL;
    assert_eq!(noted(&document, "pixel"), format!("pixel {x}, {y}"));
    let index = (y * SIZE + x) as usize;
    let (value, errors) = (result.image.pixels[index], smoothed_errors(&result, PIXEL));
    let rows: Vec<Vec<f32>> = noted(&document, "values").split('|').map(numbers).collect();
    let [own, reference] = rows.as_slice() else { panic!("{rows:?}") };
    let close = |a: f32, b: f32, relative: f32| (a - b).abs() <= relative * b.abs();
    for channel in 0..3 {
        assert!(close(own[2 * channel], value[channel], DIGITS), "{own:?} {value:?}");
        assert!(close(own[2 * channel + 1], errors[channel], ERROR_DIGITS), "{own:?} {errors:?}");
        let known = settings.reference.as_ref().unwrap().pixels[index][channel];
        assert!(close(reference[channel], known, DIGITS), "{reference:?} {known}");
    }
    assert!(numbers(noted(&document, "map"))[0] > 0.0, "maps show their value at the same pixel");
    let colours = numbers(noted(&document, "colour"));
    for (shown, value) in colours.iter().zip(value) {
        let expected = 255.0 * to_srgb(2.0 * value);
        assert!((shown - expected).abs() <= TOLERANCE, "{colours:?} {expected}");
    }
}

#[test]
fn views_zoom_together_about_the_pointer_with_square_pixels() {
    let Some((browser, folder)) = browser().zip(Some(Folder::new("zoom"))) else { return };
    let loaded = cornell();
    let settings = settings(&loaded, 1);
    let result = picture(&loaded, &settings);
    let zooms = "const state = (name) => {
            const canvases = all('.view canvas');
            note(name, document.querySelector('#zoom output').value);
            note(`${name}-views`, canvases.length);
            note(`${name}-states`, new Set(canvases.map((canvas) => canvas.style.transform)).size);
            note(`${name}-scale`, Number(canvases[0].style.transform.match(/scale\\((.*)\\)/)[1]));
            const isSquare = (canvas) => getComputedStyle(canvas).imageRendering === 'pixelated';
            note(`${name}-square`, canvases.every(isSquare));
            view.dispatchEvent(pointer('pointermove'));
            note(`${name}-pixel`, document.querySelector('#pixel').textContent);
        };
        state('opened');
        const { clientX, clientY } = pointer('pointermove');
        view.dispatchEvent(new WheelEvent('wheel', { deltaY: -400, clientX, clientY, cancelable: true }));
        state('wheel');
        key('+'); key('-'); key('0');
        state('fit');
        key('1');
        state('one');
        key('0'); key('+'); key('+'); for (let i = 0; i < 4; i++) key('ArrowRight'); key('ArrowDown');
        note('moved', all('.view canvas')[0].style.transform);
        key('0'); key('+'); key('+');
        const drag = (type, by) => {
            const { clientX, clientY } = pointer(type);
            const at = { clientX: clientX + by * view.clientWidth, clientY, pointerId: 1 };
            view.dispatchEvent(new PointerEvent(type, { bubbles: true, pointerType: 'mouse', ...at }));
        };
        drag('pointerdown', 0); drag('pointermove', 0.1); drag('pointermove', 0.25); drag('pointerup', 0.25);
        note('dragged', all('.view canvas')[0].style.transform);";
    let page = run_page(&loaded, &settings, &result);
    let (console, document) = opened(browser, &folder.0, &page, &probe(zooms));
    assert!(console.is_empty(), "{console:?}");
    let number = |name: &str| numbers(noted(&document, name))[0];
    let [x, y] = PIXEL;
    for name in ["opened", "wheel", "fit"] {
        assert_eq!(noted(&document, &format!("{name}-states")), "1", "{name}: all views are linked");
        assert_eq!(noted(&document, &format!("{name}-square")), "true", "{name}");
        assert_eq!(noted(&document, &format!("{name}-pixel")), format!("pixel {x}, {y}"), "{name}");
    }
    assert!(number("opened-views") >= 5.0);
    assert_eq!((number("opened-scale"), number("fit-scale")), (1.0, 1.0));
    assert!((number("wheel-scale") - 0.8f32.exp()).abs() < 1e-3, "{}", number("wheel-scale"));
    assert_eq!(number("one"), 100.0, "one to one");
    // At a zoom of 2 four steps of 0.075 pass the right border; one step goes down.
    let moved = numbers(noted(&document, "moved").trim_start_matches("translate"));
    assert!((moved[0] + 100.0).abs() < 0.1 && (moved[1] + 65.0).abs() < 0.1, "{moved:?}");
    let dragged = numbers(noted(&document, "dragged").trim_start_matches("translate"));
    assert!((dragged[0] + 25.0).abs() < 0.1 && (dragged[1] + 50.0).abs() < 0.1, "{dragged:?}");
}

#[test]
fn pictures_of_a_race_flip_by_keys() {
    let Some((browser, folder)) = browser().zip(Some(Folder::new("flip"))) else { return };
    let loaded = cornell();
    let settings = settings(&loaded, 1);
    let result = picture(&loaded, &settings);
    // The second method is a thousand times darker.
    let mut dark = result.clone();
    dark.image.pixels.iter_mut().flatten().for_each(|value| *value *= 1e-3);
    let flips = "const state = (name) => {
            note(name, all('#pictures input').findIndex((input) => input.checked));
            note(`${name}-colour`, colour());
        };
        state('first');
        note('chip', all('.chip')[0].textContent);
        key('n'); state('next');
        key('n'); state('last');
        key('b'); state('back');
        key('p'); state('previous');
        key('m'); note('map', document.querySelector('#map').value);
        note('mapped', all('.chip')[0].textContent);
        key('s'); note('panes', all('#stage canvas').length);
        note('right', all('.chip')[1].textContent);
        key('b'); note('swapped', all('.chip').map((chip) => chip.textContent.slice(0, 4)).join());
        key('s'); note('whole', all('#stage canvas').length);";
    let page = race_page_of(&loaded, &settings, [&result, &dark]);
    let (console, document) = opened(browser, &folder.0, &page, &probe(flips));
    assert!(console.is_empty(), "{console:?}");
    let note = |name: &str| noted(&document, name);
    assert_eq!(["first", "next", "last", "back", "previous"].map(note), ["0", "1", "2", "1", "0"]);
    let colours = ["first-colour", "next-colour", "last-colour"].map(|name| numbers(note(name))[0]);
    assert!(colours[0] > 60.0 && colours[1] < 30.0 && colours[2] > 60.0, "{colours:?}");
    assert_eq!((note("first-colour"), note("back-colour")), (note("previous-colour"), note("next-colour")));
    assert_eq!([note("chip"), note("map"), note("mapped")], ["path", "standard", "path · Standard error"]);
    assert_eq!([note("panes"), note("whole")], ["2", "1"]);
    assert!(note("right").starts_with("&lt;script&gt;"), "the second method is on the right");
    assert_eq!(note("swapped"), "&lt;scr,path");
}

#[test]
fn dark_pictures_open_bright_enough_to_be_visible() {
    let Some((browser, folder)) = browser().zip(Some(Folder::new("dark"))) else { return };
    let loaded = cornell();
    let settings = settings(&loaded, 1);
    let mut result = picture(&loaded, &settings);
    result.image.pixels.iter_mut().flatten().for_each(|value| *value *= 1e-4);
    let script = "note('stops', document.querySelector('#exposure output').value);
        note('colour', colour());
        key('E');
        note('darker', document.querySelector('#exposure output').value);
        document.querySelector('#unexposed').click();
        note('unexposed', colour());";
    let (console, document) =
        opened(browser, &folder.0, &run_page(&loaded, &settings, &result), &probe(script));
    assert!(console.is_empty(), "{console:?}");
    let number = |name: &str| numbers(noted(&document, name))[0];
    let opened = [noted(&document, "stops"), noted(&document, "colour")];
    assert!(number("stops") > 10.0 && number("colour") > 60.0, "{opened:?}");
    assert_eq!(number("darker"), number("stops") - 0.25);
    assert!(number("unexposed") < 8.0, "{}", noted(&document, "unexposed"));
}

#[test]
fn dropped_samples_have_counts_causes_and_tiles() {
    let Some((browser, folder)) = browser().zip(Some(Folder::new("dropped"))) else { return };
    let loaded = cornell();
    let settings = settings(&loaded, 3);
    let mut result = picture(&loaded, &settings);
    let open = |result: &RenderResult| {
        opened(browser, &folder.0, &run_page(&loaded, &settings, result), &probe("")).1
    };
    assert!(open(&result).contains("samples was dropped"));
    let dropped = Dropped { nan: 3, unfinished: 40_000, ..Dropped::default() };
    result.counters.dropped = dropped;
    result.rejected_tiles = vec![RejectedTile { x: 16, y: 0, width: 8, height: 16, dropped }];
    result.empty_pixels = 2;
    let page = open(&result);
    for words in [
        "40\u{202f}003 of 36\u{202f}864 samples",
        "2 pixels without any sample left",
        "<th scope=\"row\">not a number</th><td>3</td>",
        "columns 16 to 23, rows 0 to 15",
    ] {
        assert!(page.contains(words), "{words}");
    }
}

#[test]
fn pages_ask_for_nothing_else() {
    let loaded = cornell();
    let settings = settings(&loaded, 2);
    let result = picture(&loaded, &settings);
    for page in [run_page(&loaded, &settings, &result), race_page(&loaded, &settings, &result)] {
        // The namespace of SVG is a name and no address.
        let page = page.replace("http://www.w3.org/2000/svg", "");
        for needle in ["http://", "https://", "<link rel=\"stylesheet", "@import", "src=\"", "url(", "fetch("]
        {
            assert!(!page.contains(needle), "{needle}");
        }
        assert!(!page.contains("{{style}}") && page.contains("default-src 'none'"));
    }
}
