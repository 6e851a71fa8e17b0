//! Reports in a real browser: an empty console, names that stay text, and an exposure slider with the right
//! radiance. Skipped with a message without Chromium.

use core::sync::atomic::AtomicBool;
use halflight::compare::compare;
use halflight::load::{self, LoadOptions, LoadedScene};
use halflight::render::{Method, RejectedTile, RenderResult, Settings, Stop, render};
use halflight::report::{Provenance, Race, RaceEntry, Run};
use halflight::save::to_srgb;
use halflight_core::film::Dropped;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;

/// A scene name that shows in the console unless it is escaped.
const EVIL: &str =
    "<script>console.error('name')</script>\"'><img src=x onerror=console.error(1)>{{body}}.obj";

/// Tolerance of display values: the page's radiance has eight bits and is rounded twice.
const TOLERANCE: f32 = 2.5;

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
    let base = Settings { method, width: SIZE, height: SIZE, seed, stop: stop_at, ..Settings::default() };
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
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    let provenance = Provenance::here();
    let entry = |name: &str| RaceEntry {
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
    let race = Race { entries: vec![entry("path"), entry(EVIL)], seconds: 1.0, provenance: &provenance };
    index(race.files())
}

fn index(files: halflight::report::Files) -> String {
    let (_, page) = files.into_iter().find(|(name, _)| *name == "index.html").unwrap();
    String::from_utf8(page).unwrap()
}

/// The installed browser, if any.
fn browser() -> Option<&'static str> {
    ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| {
        let version =
            Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        version.is_ok_and(|status| status.success())
    })
}

/// A directory of its own, removed if the test passes.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }
}

/// Console lines after `page` ran with `script` at its end, and the document then.
fn opened(browser: &str, folder: &Path, page: &str, script: &str) -> (Vec<String>, String) {
    let file = folder.join("page.html");
    std::fs::write(&file, page.replace("</body>", &format!("<script>{script}</script></body>"))).unwrap();
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr"])
        .args(["--virtual-time-budget=10000", "--window-size=1200,900", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("file://{}", file.display()))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stderr);
    let console = said.lines().filter(|line| line.contains("CONSOLE")).map(String::from).collect();
    (console, String::from_utf8_lossy(&output.stdout).into_owned())
}

#[test]
fn pages_open_in_a_browser_without_an_error() {
    let Some(browser) = browser() else {
        println!("skipped: no Chromium on this machine");
        return;
    };
    let folder = Folder(std::env::temp_dir().join(format!("halflight-report-{}", std::process::id())));
    std::fs::create_dir_all(&folder.0).unwrap();
    let loaded = cornell();
    let settings = settings(&loaded, 1);
    let result = picture(&loaded, &settings);
    let page = run_page(&loaded, &settings, &result);

    let (console, _) = opened(browser, &folder.0, &page, "console.error('heard')");
    assert!(matches!(console.as_slice(), [one] if one.contains("heard")), "{console:?}");

    let [x, y] = PIXEL;
    let brighter = format!(
        "(async () => {{
            const figure = document.querySelector('figure.picture');
            figure.querySelector('input').value = 1;
            await figure.expose();
            const context = figure.querySelector('canvas').getContext('2d');
            document.body.dataset.probe = [...context.getImageData({x}, {y}, 1, 1).data].join();
        }})();"
    );
    let (console, document) = opened(browser, &folder.0, &page, &brighter);
    assert!(console.is_empty(), "{console:?}");
    let probe = document.split("data-probe=\"").nth(1).and_then(|rest| rest.split('"').next()).unwrap();
    let seen: Vec<f32> = probe.split(',').map(|byte| byte.parse().unwrap()).collect();
    let expected = result.image.pixels[(y * SIZE + x) as usize].map(|value| 255.0 * to_srgb(2.0 * value));
    for (seen, expected) in seen.iter().zip(expected) {
        assert!((seen - expected).abs() < TOLERANCE, "{probe}: {expected:?}");
    }
    assert!(document.contains("&lt;script&gt;console.error('name')&lt;/script&gt;"), "names are text");

    let swap = "document.querySelectorAll('select').forEach((select) => {
            select.selectedIndex = 1 - select.selectedIndex;
            select.dispatchEvent(new Event('change'));
        });";
    let (console, document) = opened(browser, &folder.0, &race_page(&loaded, &settings, &result), swap);
    assert!(console.is_empty(), "{console:?}");
    let compared = document.split("compared").nth(1).and_then(|rest| rest.split("</figure>").next()).unwrap();
    assert_eq!(compared.matches("<img").count(), 2, "two pictures side by side");
}

#[test]
fn dropped_samples_have_counts_causes_and_tiles() {
    let loaded = cornell();
    let settings = settings(&loaded, 3);
    let mut result = picture(&loaded, &settings);
    assert!(run_page(&loaded, &settings, &result).contains("samples was dropped"));
    let dropped = Dropped { nan: 3, unfinished: 40_000, ..Dropped::default() };
    result.counters.dropped = dropped;
    result.rejected_tiles = vec![RejectedTile { x: 16, y: 0, width: 8, height: 16, dropped }];
    result.empty_pixels = 2;
    let page = run_page(&loaded, &settings, &result);
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
        for needle in ["http://", "https://", "<link rel=\"stylesheet", "@import", "src=\"/", "url("] {
            assert!(!page.contains(needle), "{needle}");
        }
        assert!(page.matches("src=\"").count() == page.matches("src=\"data:image/png;base64,").count());
        assert!(!page.contains("{{style}}") && page.contains("default-src 'none'"));
    }
}
