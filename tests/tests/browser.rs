//! Headless browser for tests of the report page: opening, scripts that probe the document, and their notes.

use core::time::Duration;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::Receiver;

/// The installed browser; without one, a message that the test is skipped.
pub(crate) fn browser() -> Option<&'static str> {
    let found = ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| {
        let version =
            Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        version.is_ok_and(|status| status.success())
    });
    if found.is_none() {
        println!("skipped: no Chromium on this machine");
    }
    found
}

/// A directory of its own, removed if the test passes.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("halflight-report-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }
}

/// Console lines after `page` ran with `script` at its end, and the document then.
pub(crate) fn opened(browser: &str, folder: &Path, page: &str, script: &str) -> (Vec<String>, String) {
    let file = folder.join("page.html");
    std::fs::write(&file, with_script(page, script)).unwrap();
    opened_at(browser, folder, &format!("file://{}", file.display()), &["--disable-gpu"])
}

/// The page with a script at its end.
pub(crate) fn with_script(page: &str, script: &str) -> String {
    page.replace("</body>", &format!("<script>{script}</script></body>"))
}

/// Console lines after the page at `address` ran in a browser with `flags`, and the document then.
pub(crate) fn opened_at(
    browser: &str,
    folder: &Path,
    address: &str,
    flags: &[&str],
) -> (Vec<String>, String) {
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--enable-logging=stderr"])
        .args(["--virtual-time-budget=10000", "--window-size=1200,900", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .args(flags)
        .arg(address)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stderr);
    let console = said.lines().filter(|line| line.contains("CONSOLE")).map(String::from).collect();
    (console, String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The first message that the page at `address` posts; the browser ends then.
pub(crate) fn answer(browser: &str, folder: &Path, address: &str, posted: &Receiver<String>) -> String {
    let mut child = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(address)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // A page that does not answer for so long never does.
    let answer = posted.recv_timeout(Duration::from_secs(900));
    let _ = child.kill();
    let _ = child.wait();
    answer.expect("the page answers")
}

/// Script that runs once the page is ready, with helpers; `note(name, value)` adds a line to the document.
///
/// `pointer(type)` is an event at a pixel of a picture with sides of `size` pixels, `colour()` its colour.
pub(crate) fn probe(size: u32, [x, y]: [u32; 2], script: &str) -> String {
    format!(
        "(async () => {{
            const probe = document.body.appendChild(document.createElement('pre'));
            const note = (name, value) => {{ probe.textContent += `@${{name}}=${{value}}\\n`; }};
            const frame = () => new Promise((done) => setTimeout(done, 60));
            while (!document.documentElement.dataset.ready) await frame();
            const all = (selector) => [...document.querySelectorAll(selector)];
            const view = all('#stage .view')[0];
            const pointer = (type, of = view) => {{
                const {{ left, top, width, height }} = of.getBoundingClientRect();
                return new PointerEvent(type, {{ bubbles: true, pointerId: 1, pointerType: 'mouse',
                    clientX: left + ({x} + 0.5) / {size} * width,
                    clientY: top + ({y} + 0.5) / {size} * height }});
            }};
            const key = (key) => view.dispatchEvent(new KeyboardEvent('keydown', {{ key, bubbles: true }}));
            const values = () => all('#readout tbody tr')
                .map((row) => [...row.cells].map((cell) => cell.textContent).join(' ')).join('|');
            const colour = () => {{
                const shown = view.querySelector('canvas');
                const copy = document.createElement('canvas');
                Object.assign(copy, {{ width: shown.width, height: shown.height }});
                const context = copy.getContext('2d', {{ willReadFrequently: true }});
                context.drawImage(shown, 0, 0);
                return context.getImageData({x}, {y}, 1, 1).data.join();
            }};
            {script}
            note('done', 'yes');
        }})();"
    )
}

/// Value of a line that a probe has added to the document.
pub(crate) fn noted<'d>(document: &'d str, name: &str) -> &'d str {
    let start = document.find(&format!("@{name}=")).unwrap_or_else(|| panic!("no {name} in the probe"));
    let line = document[start..].split('\n').next().unwrap();
    line.split_once('=').unwrap().1
}

/// Numbers of a text, in the form of the page.
pub(crate) fn numbers(text: &str) -> Vec<f32> {
    let plain = text.replace('−', "-").replace("&nbsp;×&nbsp;10", "e");
    let digit = |c: char| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|raised| raised == c);
    let plain: String = plain
        .chars()
        .map(|c| if c == '⁻' { '-' } else { digit(c).map_or(c, |digit| char::from(b'0' + digit as u8)) })
        .collect();
    let words = plain.split(|c: char| !(c.is_ascii_digit() || ".-e".contains(c)));
    words.filter_map(|word| word.parse().ok()).collect()
}
