//! The page of core/bindings/wasm in a real browser: pictures by all workers have the bits of one instance,
//! files are opened, vertices baked, nothing fails, and people with assistive tools can use it. `cargo verify
//! web` builds the module and runs it.

use crate::browser::{Folder, browser};
use crate::server::{THREE, package, serve};
use core::time::Duration;
use std::path::Path;
use std::process::{Command, Stdio};

/// Checker of accessibility.
const AXE: &str = "axe-core@4.10.3";

/// Work of the page; it posts a line for each result.
const SCRIPT: &str = r#"
const results = [];
const note = (name, value) => results.push(`${name}=${value}`);
window.addEventListener('error', (event) => note('error', event.message));
window.addEventListener('unhandledrejection', (event) => note('error', event.reason));
console.error = (...parts) => note('error', parts.join(' '));
(async () => {
    try {
        const frame = () => new Promise((done) => setTimeout(done, 50));
        while (!document.documentElement.dataset.ready) await frame();
        const { page, render, bake, open } = window.halflight;
        const set = (id, value) => { document.getElementById(id).value = value; };
        set('width', 64);
        set('height', 48);
        document.getElementById('reconstruct').checked = false;

        await render({ samples: 24, error: 0 });
        const { load } = await import('/halflight.js');
        const { object, notes, ...description } = page.description;
        const one = (await load()).scene(description).renderer({ width: 64, height: 48, method: 'path' });
        one.step({ samples: 24 });
        const alone = one.picture();
        note('same', page.state.picture.every((value, i) => value === alone[i]) && alone.length === 9216);
        note('error of all', JSON.stringify(page.state.error) === JSON.stringify(one.error()));
        note('lit', alone.reduce((sum, value) => sum + value) / alone.length > 0.05);
        note('text', document.getElementById('state').textContent);
        note('band', document.querySelectorAll('#curve polygon').length);
        note('saves', !document.getElementById('png').disabled && !document.getElementById('exr').disabled);

        const { violations } = await window.axe.run();
        const serious = violations.filter(({ impact }) => impact === 'serious' || impact === 'critical');
        note('serious', serious.map(({ id, nodes }) => `${id}: ${nodes[0].html}`).join('; '));

        const baked = await bake({ samples: 16 });
        const isShown = !document.getElementById('baked').hidden;
        note('baked', baked.irradiance.some((value) => value > 0) && isShown);
        note('intervals', baked.lower.every((low, i) => low <= baked.upper[i]));

        const file = (name, text) => new File([text], name);
        await open([
            file('room.obj', ['mtllib room.mtl', 'v -1 0 -1', 'v 1 0 -1', 'v 1 0 1', 'v -1 0 1', 'v -1 2 -1',
                'v 1 2 -1', 'v 1 2 1', 'v -1 2 1', 'usemtl floor', 'f 4 3 2 1', 'usemtl lamp', 'f 5 6 7 8',
                '',
            ].join('\n')),
            file('room.mtl', ['newmtl floor', 'Kd 0.5 0.5 0.5', 'newmtl lamp', 'Kd 0 0 0', 'Ke 1 1 1', '',
                '',
            ].join('\n')),
        ]);
        note('triangles', page.description.triangles.length / 3);
        await render({ samples: 4, error: 0 });
        note('floor', page.state.picture.some((value) => value > 0));
        const refused = (error) => note('refused', error.message);
        await open([file('none.txt', '')]).then(() => note('refused', 'no'), refused);
    } catch (error) {
        note('error', error.stack ?? error);
    }
    note('done', 'yes');
    await fetch('/results', { method: 'POST', body: results.join('\n') });
})();
"#;

#[test]
#[ignore = "`cargo verify web` builds the module and runs it"]
fn the_page_renders_opens_and_bakes() {
    let (Some(browser), Some(three), Some(axe)) = (browser(), package(THREE), package(AXE)) else { return };
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/bindings/wasm");
    assert!(source.join("halflight.wasm").exists(), "`cargo verify web` builds the module");
    let folder = Folder::new("web");
    std::fs::create_dir_all(folder.0.join("page")).unwrap();
    for file in [
        "halflight.js",
        "halflight.wasm",
        "pool.js",
        "three.js",
        "worker.js",
        "page/page.js",
        "page/style.css",
    ] {
        std::fs::copy(source.join(file), folder.0.join(file)).unwrap();
    }
    let page = std::fs::read_to_string(source.join("page/index.html")).unwrap();
    let scripts = "<script src=\"/axe/axe.min.js\"></script><script src=\"/test.js\"></script></body>";
    std::fs::write(folder.0.join("page/index.html"), page.replace("</body>", scripts)).unwrap();
    std::fs::write(folder.0.join("test.js"), SCRIPT).unwrap();
    let (port, results) = serve(folder.0.clone(), &[("three", three), ("axe", axe)]);

    let mut child = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        .arg(format!("--user-data-dir={}", folder.0.join("profile").display()))
        .arg(format!("http://127.0.0.1:{port}/page/index.html"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // A page that does not answer for so long never does.
    let results = results.recv_timeout(Duration::from_secs(900));
    let _ = child.kill();
    let _ = child.wait();
    let results = results.expect("the page answers");
    println!("{results}");
    let value = |name: &str| {
        let line = results.lines().find_map(|line| line.strip_prefix(&format!("{name}=")));
        line.unwrap_or_else(|| panic!("no {name}: {results}"))
    };
    for name in ["same", "error of all", "lit", "saves", "baked", "intervals", "floor"] {
        assert_eq!(value(name), "true", "{name}: {results}");
    }
    assert_eq!([value("band"), value("triangles"), value("serious"), value("done")], ["1", "4", "", "yes"]);
    assert!(value("text").starts_with("24 samples per pixel by path") && value("text").contains("relMSE"));
    assert!(value("refused").contains("no .obj"), "{results}");
    assert!(!results.contains("error="), "{results}");
}
