//! The page of core/bindings/wasm in a real browser: pictures by all workers have the bits of one instance,
//! files are opened and dropped, vertices and probes baked, nothing fails, and people with assistive tools
//! can use it. Probes are those of the program, and three.js shows their light. `cargo verify web` builds the
//! module and runs it.

use crate::browser::{Folder, answer, browser};
use crate::server::{THREE, package, serve};
use core::f32::consts::PI;
use core::sync::atomic::AtomicBool;
use halflight::bake::{BakeSettings, Probe, ProbeGrid, ProbeSettings, irradiance};
use halflight::load::{LoadOptions, load};
use halflight::memory::Budget;
use halflight::render::Stop;
use halflight::save::{from_srgb, read};
use halflight_core::glam::Vec3;
use halflight_core::{LightProbe, Rgb};
use std::fs;
use std::path::Path;

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

        const { bakeVertices, bakeProbes } = window.halflight;
        const baked = await bake(bakeVertices, { samples: 16 });
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

        // A glb is dropped, paused and continued, and its picture saved.
        const bytes = await (await fetch('/room.glb')).arrayBuffer();
        const dropped = new DataTransfer();
        dropped.items.add(new File([bytes], 'room.glb'));
        page.state = null;
        document.body.dispatchEvent(new DragEvent('drop', { dataTransfer: dropped, cancelable: true }));
        while (!(page.state?.samples >= 2)) await frame();
        const samples = page.state.samples;
        document.getElementById('pause').click();
        const seen = new Set([samples]);
        for (let i = 0; i < 40; i++) {
            await frame();
            seen.add(page.state.samples);
        }
        // The round at work may end.
        note('pauses', seen.size <= 2);
        const last = page.state.samples;
        document.getElementById('pause').click();
        while (page.state.samples === last) await frame();
        page.stop.abort();
        const saved = new Promise((resolve) => {
            HTMLAnchorElement.prototype.click = function () { resolve(fetch(this.href)); };
        });
        const picture = page.state.picture;
        document.getElementById('exr').click();
        const exr = new Uint8Array(await (await saved).arrayBuffer());
        note('exr', [...exr].map((byte) => byte.toString(16).padStart(2, '0')).join(''));
        note('picture', picture.join(' '));

        set('width', 200);
        set('height', 200);
        const { grid, coefficients, halfWidths, inside } = await bake(bakeProbes, { most: 27, samples: 256 });
        note('size', grid.size);
        note('inside', inside.includes(1));
        note('coefficients', coefficients.join(' '));
        note('half-widths', halfWidths.join(' '));
        const { view } = page;
        const ball = view.scene.getObjectByName('ball');
        const normal = view.camera.position.clone().sub(ball.position).normalize();
        note('normal', normal.toArray().join(' '));
        note('radius', ball.geometry.parameters.radius);
        view.draw();
        const gl = view.renderer.getContext();
        const rgba = new Uint8Array(4);
        gl.readPixels(100, 100, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
        note('pixel', [...rgba].join(' '));
        const refused = (error) => note('refused', error.message);
        await open([file('none.txt', '')]).then(() => note('refused', 'no'), refused);
    } catch (error) {
        note('error', error.stack ?? error);
    }
    note('done', 'yes');
    await fetch('/results', { method: 'POST', body: results.join('\n') });
})();
"#;

/// A closed room with white walls and a lamp below its ceiling, as binary glTF without normals.
fn room() -> Vec<u8> {
    let quad = |axis: usize, side: f32, half: f32| {
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[u, v]| {
            let mut corner = [0.0f32; 3];
            (corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (side, u, v);
            corner
        });
        // Fronts look inwards.
        if side > 0.0 { [0, 3, 2, 1].map(|i| corners[i]) } else { corners }
    };
    let walls = (0..6).map(|wall| quad(wall / 2, if wall % 2 == 0 { -1.0 } else { 1.0 }, 1.0));
    let positions: Vec<[f32; 3]> = walls.chain([quad(1, 0.98, 0.3)]).flatten().collect();
    let indices = (0..7u16).flat_map(|quad| [0, 1, 2, 0, 2, 3].map(|corner| 4 * quad + corner));
    let mut binary: Vec<u8> = positions.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    binary.extend(indices.flat_map(u16::to_le_bytes));
    let mut json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0},{"camera":0,"translation":[0,0,0.9]}],
        "cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0.1,"zfar":10}}],
        "extensionsUsed":["KHR_materials_emissive_strength","KHR_materials_specular"],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0},
            {"attributes":{"POSITION":0},"indices":2,"material":1}]}],
        "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.7,0.6,0.5,1],"metallicFactor":0},
            "extensions":{"KHR_materials_specular":{"specularFactor":0}}},
            {"pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1],"metallicFactor":0},"emissiveFactor":[1,1,1],
            "extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":6},
            "KHR_materials_specular":{"specularFactor":0}}}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":28,"type":"VEC3","min":[-1,-1,-1],"max":[1,1,1]},
            {"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"},
            {"bufferView":1,"byteOffset":72,"componentType":5123,"count":6,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":336},{"buffer":0,"byteOffset":336,"byteLength":84}],
        "buffers":[{"byteLength":420}]}"#
        .to_owned();
    json.extend(core::iter::repeat_n(' ', json.len().next_multiple_of(4) - json.len()));
    let chunk = |kind: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes(), kind, bytes].concat();
    let chunks = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &binary)].concat();
    let length = chunks.len() as u32 + 12;
    [b"glTF".as_slice(), &2u32.to_le_bytes(), &length.to_le_bytes(), &chunks].concat()
}

/// The program's 27 probes of a file.
fn probes_of(file: &Path) -> Vec<Probe> {
    let loaded = load(file, &LoadOptions::default()).unwrap();
    let settings = ProbeSettings { size: [3; 3], bounds: None, cubes: false };
    let grid = ProbeGrid::new(&loaded, settings, &mut Budget::new(None)).unwrap();
    let stop = Stop { spp: Some(256), ..Stop::default() };
    let settings = BakeSettings { stop, back_faces: true, ..BakeSettings::default() };
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    grid.probes(&irradiance(&scene, grid.points(), &settings, &mut |_| {}, &AtomicBool::new(false)).unwrap())
}

/// Irradiance of `normal` at `position` by 27 probes of the box from -1 to 1, interpolated.
fn interpolated(probes: &[LightProbe], position: Vec3, normal: Vec3) -> Rgb {
    let place = ((position + 1.0) * 1.5 - 0.5).clamp(Vec3::ZERO, Vec3::splat(2.0));
    let corners = (0..27).map(|cell| [cell % 3, cell / 3 % 3, cell / 9].map(|axis| axis as f32));
    let weights = corners.map(|corner| {
        (Vec3::ONE - (place - Vec3::from(corner)).abs()).max(Vec3::ZERO).to_array().iter().product::<f32>()
    });
    weights.zip(probes).map(|(weight, probe)| weight * probe.irradiance(normal)).sum()
}

/// Most of the light of the ball in the browser that is not that of the probes: bytes, half floats, and the
/// normals of a sphere of triangles.
const BALL: f32 = 0.02;

/// The probes of the page are those of the program, and the ball in the page has their light.
fn assert_probes(numbers: &dyn Fn(&str) -> Vec<f32>, own: &[Probe]) {
    let (coefficients, half_widths) = (numbers("coefficients"), numbers("half-widths"));
    let light = |cell: usize| LightProbe {
        coefficients: core::array::from_fn(|i| Rgb::from_slice(&coefficients[27 * cell + 3 * i..])),
        half_widths: core::array::from_fn(|i| half_widths[9 * cell + i]),
    };
    let probes: Vec<_> = (0..27).map(light).collect();
    let luminance = |colour: Rgb| colour.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    let pairs = probes.iter().zip(own).flat_map(|(probe, own)| (0..9).map(move |i| (probe, own, i)));
    let agree = pairs.filter(|(probe, own, i)| {
        let difference = luminance(probe.coefficients[*i] - own.coefficients[*i]).abs();
        difference <= probe.half_widths[*i].hypot(own.half_widths[*i])
    });
    let agree = agree.count();
    // Intervals of 95 %: five standard deviations fewer than 231 of 243 are 214.
    assert!(agree >= 214, "{agree} of 243 coefficients agree");
    assert!(probes.iter().all(|probe| probe.half_widths[0] < 0.1 * luminance(probe.coefficients[0])));

    // three.js shifts a place by half a cell along its normal.
    let normal = Vec3::from_slice(&numbers("normal"));
    let light = interpolated(&probes, (numbers("radius")[0] + 1.0 / 3.0) * normal, normal) / PI;
    let shown: Vec<f32> = numbers("pixel").iter().take(3).map(|byte| from_srgb(byte / 255.0)).collect();
    let shown = Rgb::from_slice(&shown);
    assert!((shown - light).abs().max_element() < BALL && light.min_element() > 0.1, "{shown} {light}");
}

#[test]
#[ignore = "`cargo verify web` builds the module and runs it"]
fn the_page_renders_opens_and_bakes() {
    let (Some(browser), Some(three), Some(axe)) = (browser(), package(THREE), package(AXE)) else { return };
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/bindings/wasm");
    assert!(source.join("halflight.wasm").exists(), "`cargo verify web` builds the module");
    let folder = Folder::new("web");
    fs::create_dir_all(folder.0.join("page")).unwrap();
    for file in [
        "halflight.js",
        "halflight.wasm",
        "pool.js",
        "three.js",
        "probes.js",
        "worker.js",
        "page/baked.js",
        "page/page.js",
        "page/style.css",
    ] {
        fs::copy(source.join(file), folder.0.join(file)).unwrap();
    }
    let page = fs::read_to_string(source.join("page/index.html")).unwrap();
    let scripts = "<script src=\"/axe/axe.min.js\"></script><script src=\"/test.js\"></script></body>";
    fs::write(folder.0.join("page/index.html"), page.replace("</body>", scripts)).unwrap();
    fs::write(folder.0.join("test.js"), SCRIPT).unwrap();
    fs::write(folder.0.join("room.glb"), room()).unwrap();
    let (port, results) = serve(folder.0.clone(), &[("three", three), ("axe", axe)]);

    let results = answer(browser, &folder.0, &format!("http://127.0.0.1:{port}/page/index.html"), &results);
    println!("{results}");
    let value = |name: &str| {
        let line = results.lines().find_map(|line| line.strip_prefix(&format!("{name}=")));
        line.unwrap_or_else(|| panic!("no {name}: {results}"))
    };
    for name in ["same", "error of all", "lit", "saves", "baked", "intervals", "floor", "pauses"] {
        assert_eq!(value(name), "true", "{name}: {results}");
    }
    assert_eq!([value("band"), value("triangles"), value("serious"), value("done")], ["1", "4", "", "yes"]);
    assert!(value("text").starts_with("24 samples per pixel by path") && value("text").contains("relMSE"));
    assert!(value("refused").contains("no .obj"), "{results}");
    assert!(!results.contains("error="), "{results}");

    let numbers = |name: &str| -> Vec<f32> {
        value(name).split([' ', ',']).map(|number| number.parse().unwrap()).collect()
    };
    let hexadecimal = value("exr").as_bytes().chunks(2).map(|digits| str::from_utf8(digits).unwrap());
    let exr: Vec<u8> = hexadecimal.map(|digits| u8::from_str_radix(digits, 16).unwrap()).collect();
    fs::write(folder.0.join("saved.exr"), exr).unwrap();
    let saved = read(&folder.0.join("saved.exr")).unwrap();
    assert_eq!(saved.pixels.as_flattened(), numbers("picture"));
    assert!(saved.pixels.iter().all(|pixel| pixel[2] > 0.0), "light is in every corner of the room");
    assert_eq!([value("size"), value("inside")], ["3,3,3", "false"]);
    assert_probes(&numbers, &probes_of(&folder.0.join("room.glb")));
}
