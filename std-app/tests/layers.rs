//! Layers of pictures: against an analytic sphere, a second search of surfaces, many seeds, and in files.

use crate::support::Folder;
use core::sync::atomic::AtomicBool;
use exr::meta::attribute::AttributeValue;
use exr::prelude::{ReadChannels, ReadLayers, read};
use halflight::Renderer;
use halflight::layers::id;
use halflight::load::{LoadOptions, PartMesh, SceneParts, View, load};
use halflight::render::{Layer, LayerSettings, Method, Reconstruct, RenderResult, Settings, Stop};
use halflight_core::bvh::Bvh;
use halflight_core::memory::{Arena, Line};
use halflight_core::reconstruction::{Coverage, PixelLayers};
use halflight_core::scene::Material;
use halflight_core::{Level, Rgb};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

const CORNELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.obj");

fn settings(renderer: &Renderer, [width, height]: [u32; 2], spp: u32) -> Settings {
    let layers = Some(Arc::new(LayerSettings::new(&Layer::ALL, &renderer.scene().triangle_objects)));
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let (method, reconstruct) = (Some(Method::Path), Reconstruct::Off);
    Settings { method, width, height, stop, reconstruct, layers, ..Settings::default() }
}

/// Arrays of a mesh.
#[derive(Default)]
struct Arrays {
    positions: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// Sphere of many triangles with smooth normals.
fn sphere(middle: [f64; 3], radius: f64) -> Arrays {
    const ROWS: u32 = 400;
    const COLUMNS: u32 = 800;
    let Arrays { mut positions, mut normals, mut triangles } = Arrays::default();
    for row in 0..=ROWS {
        let (sin, cos) = (core::f64::consts::PI * f64::from(row) / f64::from(ROWS)).sin_cos();
        for column in 0..=COLUMNS {
            let (x, z) = (core::f64::consts::TAU * f64::from(column) / f64::from(COLUMNS)).sin_cos();
            let normal = [sin * x, cos, sin * z];
            normals.push(normal);
            positions.push(core::array::from_fn(|i| middle[i] + radius * normal[i]));
            if row < ROWS && column < COLUMNS {
                let [a, b] = [row, row + 1].map(|row| row * (COLUMNS + 1) + column);
                triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
            }
        }
    }
    Arrays { positions, normals, triangles }
}

#[test]
fn depth_position_and_normal_are_those_of_a_sphere() {
    /// Error of depth and position relative to the radius, and of normals: rounding, facets of 0.008 radians,
    /// and pixels of 0.003 radians of the sphere.
    const TOLERANCE: f64 = 1e-4;
    const SIZE: [u32; 2] = [96, 64];
    let (middle, radius) = ([5.0, 1.0, -20.0], 3.0);
    let Arrays { positions, normals, triangles } = sphere(middle, radius);
    let mut parts = SceneParts::default();
    let white = parts.material("white", Material::diffuse(Rgb::splat(0.25)));
    let mesh = PartMesh { positions: &positions, normals: &normals, triangles: &triangles, texcoords: &[] };
    parts.mesh("ball", &mesh, white).unwrap();
    let eye = [5.0, 1.0, 10.0];
    parts.view(View { eye, look_at: middle, up: [0.0, 1.0, 0.0] }, 1.2);
    let renderer = Renderer::new(parts.build().unwrap(), None).unwrap();
    let result = renderer.render(&settings(&renderer, SIZE, 1)).unwrap();
    let transform = renderer.scene().transform;
    for (at, pixel) in result.layers.surfaces.iter().enumerate() {
        let (x, y) = (at as u32 % SIZE[0], at as u32 / SIZE[0]);
        let film = 2.0 * 0.6f64.to_radians().tan() / f64::from(SIZE[1]);
        let x = (f64::from(x) + 0.5 - 0.5 * f64::from(SIZE[0])) * film;
        let y = (0.5 * f64::from(SIZE[1]) - f64::from(y) - 0.5) * film;
        let length = (1.0 + x * x + y * y).sqrt();
        let direction = [x / length, y / length, -1.0 / length];
        // The nearer root of |eye + t direction - middle| = radius, with the middle 30 ahead.
        let along = -30.0 * direction[2];
        let depth = along - (along * along - 900.0 + radius * radius).sqrt();
        let point: [f64; 3] = core::array::from_fn(|i| eye[i] + depth * direction[i]);
        let found = f64::from(pixel.depth) / transform.length(1.0);
        assert!((found - depth).abs() < TOLERANCE * radius, "{at}: {found} {depth}");
        let position = transform.to_user(pixel.position.into());
        for i in 0..3 {
            // A mean over a pixel: the position varies by a thousandth of the radius.
            assert!((position[i] - point[i]).abs() < TOLERANCE * radius, "{at}: {position:?} {point:?}");
            let normal = (point[i] - middle[i]) / radius;
            assert!((f64::from(pixel.normal[i]) - normal).abs() < TOLERANCE, "{at}: {:?}", pixel.normal);
        }
        assert_eq!((pixel.albedo, pixel.objects[0]), ([0.25; 3], Coverage { id: 0, fraction: 1.0 }));
        assert_eq!(pixel.materials[0].fraction, 1.0);
    }
}

fn fraction_of(coverage: &[Coverage], id: u32) -> f32 {
    coverage.iter().filter(|one| one.id == id).map(|one| one.fraction).sum()
}

#[test]
fn objects_and_materials_are_those_of_single_rays() {
    const SIZE: [u32; 2] = [48, 32];
    /// Rays of the second search, across and down a pixel.
    const GRID: u32 = 16;
    /// Difference of the fractions by a grid, which has steps of a sixteenth at its borders, and by 256 rays.
    const TOLERANCE: f32 = 0.07;
    let folder = Folder::new("single-rays");
    std::fs::write(folder.path("objects.obj"), OBJECTS).unwrap();
    let renderer = Renderer::open(folder.path("objects.obj")).unwrap();
    let loaded = renderer.scene();
    // The floor is behind the lower edges of the quads, and nothing behind the upper ones.
    let view = View { eye: [0.1, 1.95, 2.2], look_at: [0.0, 0.4, 0.0], up: [0.0, 1.0, 0.0] };
    let camera = renderer.camera(view, 50.0).unwrap();
    let (settings, never) = (settings(&renderer, SIZE, 1), AtomicBool::new(false));
    let result = renderer.render_with(camera, &settings, &mut |_| {}, &never).unwrap();
    let mesh = loaded.mesh();
    let mut lines = vec![Line::ZERO; 1 << 16];
    let bvh = Bvh::build(&mesh, &mut Arena::over(&mut lines)).unwrap();
    let level = Level::detect();
    let [mut mixed, mut partial] = [0; 2];
    for (at, pixel) in result.layers.surfaces.iter().enumerate() {
        let [mut objects, mut materials] = [BTreeMap::new(), BTreeMap::new()];
        for ray in 0..GRID * GRID {
            let [x, y] = [ray % GRID, ray / GRID].map(|i| (i as f32 + 0.5) / GRID as f32);
            let (x, y) = (x + (at as u32 % SIZE[0]) as f32, y + (at as u32 / SIZE[0]) as f32);
            let hit = bvh.nearest(level, &camera.ray(SIZE[0], SIZE[1], x, y, [0.5; 2]));
            if let Some(triangle) = mesh.triangles.get(hit.triangle as usize) {
                *objects.entry(loaded.triangle_objects[hit.triangle as usize]).or_insert(0) += 1;
                *materials.entry(triangle.material).or_insert(0) += 1;
            }
        }
        mixed += u32::from(objects.len() > 1);
        let hits: u32 = objects.values().sum();
        partial += u32::from(hits > 0 && hits < GRID * GRID);
        let all = (GRID * GRID) as f32;
        for (expected, found) in [(&objects, &pixel.objects), (&materials, &pixel.materials)] {
            let sum: f32 = found.iter().map(|one| one.fraction).sum();
            let hits: u32 = expected.values().sum();
            assert!((sum - hits as f32 / all).abs() < TOLERANCE, "{at}: {expected:?} {found:?}");
            for (id, count) in expected.iter() {
                let error = (fraction_of(found, *id) - *count as f32 / all).abs();
                assert!(error < TOLERANCE, "{at}: {expected:?} {found:?}");
            }
            assert!(found.windows(2).all(|pair| pair[0].fraction >= pair[1].fraction), "{found:?}");
        }
    }
    assert!(mixed > 10 && partial > 10, "{mixed} and {partial} pixels at edges");
}

#[test]
fn error_is_the_deviation_over_seeds() {
    const SEEDS: u32 = 64;
    /// Five standard deviations of the ratio: estimates of one degree of freedom with the tails of paths.
    const TOLERANCE: f64 = 0.1;
    let renderer = Renderer::open(CORNELL).unwrap();
    let render = |seed| {
        let usual = settings(&renderer, [24, 16], 16);
        renderer.render(&Settings { seed, caustics: false, reuse: Some(false), ..usual }).unwrap()
    };
    let results: Vec<RenderResult> = (0..SEEDS).map(render).collect();
    let (mut estimated, mut measured) = (0.0, 0.0);
    for pixel in 0..24 * 16 {
        for channel in 0..3 {
            let of = |result: &RenderResult| f64::from(result.image.pixels[pixel][channel]);
            let mean = results.iter().map(of).sum::<f64>() / f64::from(SEEDS);
            // Relative to the pixel, so that none outweighs the others.
            let weight = 1.0 / (mean * mean + 1e-4);
            let squares: f64 = results.iter().map(|result| (of(result) - mean).powi(2)).sum();
            measured += weight * squares / f64::from(SEEDS - 1);
            let variance = |result: &RenderResult| f64::from(result.variance.pixels[pixel][channel]);
            estimated += weight * results.iter().map(variance).sum::<f64>() / f64::from(SEEDS);
        }
    }
    assert!((estimated / measured - 1.0).abs() < TOLERANCE, "{estimated} {measured}");
    let [even, odd] = results[0].layers.halves.as_ref().unwrap();
    for (pixel, (a, b)) in results[0].image.pixels.iter().zip(even.pixels.iter().zip(&odd.pixels)) {
        // Both halves have eight samples.
        assert!((0..3).all(|c| (pixel[c] - 0.5 * (a[c] + b[c])).abs() <= 1e-6 * pixel[c].max(1.0)));
    }
}

#[test]
fn layers_change_no_bit_of_the_picture_and_do_not_depend_on_threads() {
    let renderer = Renderer::open(CORNELL).unwrap();
    let with = settings(&renderer, [40, 30], 4);
    let render = |threads, layers: bool| {
        let layers = if layers { with.layers.clone() } else { None };
        renderer.render(&Settings { threads, layers, ..with.clone() }).unwrap()
    };
    let [plain, one, three] = [render(None, false), render(Some(1), true), render(Some(3), true)];
    assert!(plain.image == one.image && plain.image == three.image);
    assert!(plain.layers.surfaces.is_empty() && plain.layers.halves.is_none());
    assert!(one.layers == three.layers && one.layers.surfaces.len() == 40 * 30);
    assert!(one.layers.surfaces.iter().any(|pixel| *pixel != PixelLayers::default()));
}

/// A file of OpenEXR.
struct File {
    /// Names of the channels of each part.
    parts: Vec<Vec<String>>,
    channels: BTreeMap<String, Vec<f32>>,
    attributes: BTreeMap<String, AttributeValue>,
}

impl File {
    fn read(path: &Path) -> Self {
        let layers = read().no_deep_data().largest_resolution_level().all_channels().all_layers();
        let image = layers.all_attributes().from_file(path).unwrap();
        let (mut parts, mut channels) = (Vec::new(), BTreeMap::new());
        for part in &image.layer_data {
            let list = &part.channel_data.list;
            parts.push(list.iter().map(|channel| channel.name.to_string()).collect());
            let values = list.iter().map(|channel| {
                let values = channel.sample_data.values_as_f32().collect();
                (channel.name.to_string(), values)
            });
            channels.extend(values);
        }
        let of_image = &image.attributes.other;
        let of_part = image.layer_data.iter().flat_map(|part| &part.attributes.other);
        let all = of_image.iter().chain(of_part);
        let mut attributes: BTreeMap<_, _> =
            all.map(|(name, value)| (name.to_string(), value.clone())).collect();
        for part in &image.layer_data {
            let software = part.attributes.software_name.clone().unwrap();
            attributes.insert("software".into(), AttributeValue::Text(software));
            assert!(part.attributes.capture_date.as_ref().unwrap().to_string().starts_with("20"));
        }
        Self { parts, channels, attributes }
    }

    fn text(&self, name: &str) -> String {
        match &self.attributes[name] {
            AttributeValue::Text(text) => String::from_utf8(text.as_slice().to_vec()).unwrap(),
            other => panic!("{name}: {other:?}"),
        }
    }
}

/// Two quads over a floor, as objects.
const OBJECTS: &str = "mtllib scene.mtl\n\
    v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
    v -0.6 0.5 0\nv -0.1 0.5 0\nv -0.1 1 0.1\nv -0.6 1 0.1\n\
    v 0.1 0.5 0\nv 0.6 0.5 0\nv 0.6 1 0.1\nv 0.1 1 0.1\n\
    o Boden\nusemtl floor\nf 4 3 2 1\no lamp\nusemtl lamp\nf 5 6 7 8\n\
    o left «é»\nusemtl floor\nf 9 10 11 12\no right\nf 13 14 15 16\n";

const VIEW: &str = "--eye 0,1,3 --look-at 0,0.8,0 --fov 50 --size 70x50";

#[test]
fn files_have_the_picture_alone_and_a_part_for_each_layer() {
    let folder = Folder::new("layers");
    std::fs::write(folder.path("objects.obj"), OBJECTS).unwrap();
    let render = format!("render objects.obj {VIEW} --spp 8 --seed 7 --method path --json");
    folder.object(&format!("{render} -o plain.exr"));
    let object = folder.object(&format!("{render} --aov all -o with.exr"));
    let (plain, with) = (File::read(&folder.path("plain.exr")), File::read(&folder.path("with.exr")));
    assert_eq!(plain.parts, [["B", "G", "R"]]);
    assert_eq!(with.parts[0], ["B", "G", "R"]);
    for name in ["R", "G", "B"] {
        assert!(plain.channels[name] == with.channels[name], "{name}");
    }
    let layers = "CryptoMaterial00 CryptoMaterial01 CryptoMaterial02 CryptoObject00 CryptoObject01 CryptoObject02 \
                  albedo depth error even material normal object odd position samples";
    let name = |part: &Vec<String>| {
        let names: Vec<&str> = part.iter().map(|name| name.split_once('.').unwrap().0).collect();
        assert!(names.iter().all(|name| *name == names[0]), "{names:?}");
        names[0].to_owned()
    };
    let names: Vec<String> = with.parts[1..].iter().map(name).collect();
    assert_eq!(names.join(" "), layers);
    assert!(with.channels["samples.X"].iter().all(|samples| *samples == 8.0));

    for file in [&plain, &with] {
        assert_eq!((file.text("scene"), file.text("method")), ("objects.obj".into(), "path".into()));
        assert_eq!(file.attributes["seed"], AttributeValue::I32(7));
        assert_eq!(file.attributes["samplesPerPixel"], AttributeValue::I32(8));
        assert!(file.text("command").contains("render objects.obj --eye 0,1,3"));
        assert!(file.text("software").starts_with("halflight 0."));
        assert!(matches!(file.attributes["renderTime"], AttributeValue::F32(seconds) if seconds > 0.0));
    }
    let relmse = object["error"]["relmse"].as_f64().unwrap() as f32;
    assert_eq!(with.attributes["relMSE"], AttributeValue::F32(relmse));
    let AttributeValue::FloatVec2(interval) = with.attributes["relMSEInterval"] else {
        panic!("no interval")
    };
    assert!(interval.0 <= relmse && relmse <= interval.1);
}

#[test]
fn cryptomatte_covers_pixels_and_its_manifest_has_all_names() {
    let folder = Folder::new("cryptomatte");
    std::fs::write(folder.path("objects.obj"), OBJECTS).unwrap();
    folder.object(&format!("render objects.obj {VIEW} --spp 1 --aov object,material -o a.exr --json"));
    let file = File::read(&folder.path("a.exr"));
    let names = ["Boden", "lamp", "left «é»", "right"];
    let keys: Vec<_> = file.attributes.keys().filter(|key| key.ends_with("/name")).collect();
    assert_eq!(keys.len(), 2);
    for key in keys {
        let layer = file.text(key);
        let of = |part: &str| file.text(&key.replace("name", part));
        assert_eq!((of("hash"), of("conversion")), ("MurmurHash3_32".into(), "uint32_to_float32".into()));
        let manifest: BTreeMap<String, String> = serde_json::from_str(&of("manifest")).unwrap();
        for (name, hex) in &manifest {
            assert_eq!(*hex, format!("{:08x}", id(name).to_bits()));
        }
        let known: Vec<u32> = manifest.keys().map(|name| id(name).to_bits()).collect();
        let channel = |rank: usize, letters: [&str; 2]| {
            &file.channels[&format!("{layer}{:02}.{}", rank / 2, letters[rank % 2])]
        };
        let first = if layer == "CryptoObject" { "object.X" } else { "material.X" };
        for at in 0..70 * 50 {
            let ranks = (0..6).map(|rank| (channel(rank, ["R", "B"])[at], channel(rank, ["G", "A"])[at]));
            let ranks: Vec<(f32, f32)> = ranks.filter(|(_, fraction)| *fraction > 0.0).collect();
            assert!(ranks.iter().all(|(id, _)| known.contains(&id.to_bits())), "{at}: {ranks:?}");
            let sum: f32 = ranks.iter().map(|(_, fraction)| fraction).sum();
            assert!(sum <= 1.0 + 1e-6);
            // All rays of a pixel that escapes in part are counted alike.
            if file.channels[first][at] < 0.0 {
                assert_eq!(sum, 0.0);
            }
        }
        if layer == "CryptoObject" {
            assert_eq!(manifest.keys().map(String::as_str).collect::<Vec<_>>(), names);
            assert_eq!(file.text("objects"), serde_json::to_string(&names).unwrap());
        }
    }
    // Inside of the picture every ray meets an object: coverage is whole, and that of objects is unmixed.
    let of_floor = 40 * 70 + 35;
    assert_eq!(file.channels["object.X"][of_floor], 0.0);
    assert_eq!(file.channels["CryptoObject00.R"][of_floor], id("Boden"));
    assert_eq!(file.channels["CryptoObject00.G"][of_floor], 1.0);
}

#[test]
fn resumed_and_merged_pictures_keep_their_layers() {
    let folder = Folder::new("kept-layers");
    std::fs::write(folder.path("objects.obj"), OBJECTS).unwrap();
    let render = format!("render objects.obj {VIEW} --method path --json");
    folder.object(&format!("{render} --spp 8 --aov all -o whole.exr"));
    folder.object(&format!("{render} --spp 4 --checkpoint part -o part.exr"));
    folder.object(&format!("{render} --spp 8 --aov all --resume part -o resumed.exr"));
    for shard in 1..=2 {
        folder.object(&format!("{render} --spp 8 --shard {shard}/2 --checkpoint {shard}.film"));
    }
    let said = folder.run("merge 1.film 2.film --aov all -o merged.exr");
    let said = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(said.contains("layers left out: depth, position, material, object"), "{said}");
    let [whole, resumed, merged] =
        ["whole.exr", "resumed.exr", "merged.exr"].map(|name| File::read(&folder.path(name)));
    assert!(whole.channels == resumed.channels);
    for layer in ["albedo.R", "normal.Y", "error.G", "samples.X", "even.B", "odd.R", "R"] {
        assert!(whole.channels[layer] == merged.channels[layer], "{layer}");
    }
    let said = folder.refused("merge 1.film 2.film --aov albedo,depth -o no.exr");
    assert!(said.contains("films have no depth") && said.contains("--aov depth --spp 1"), "{said}");
}

#[test]
fn layers_without_a_file_are_refused() {
    let folder = Folder::new("no-layers");
    let said = folder.refused("render scene.obj --aov depth,error -o a.png -o a.hdr");
    assert!(said.contains("--aov depth,error: layers need an OpenEXR file"), "{said}");
    let said = folder.refused("render scene.obj --aov depth,colour -o a.exr");
    assert!(said.contains("'colour'") && said.contains("halves"), "{said}");
    assert!(!folder.path("a.exr").exists());
}

#[test]
fn copies_of_a_mesh_are_objects_of_their_own() {
    let folder = Folder::new("copies");
    std::fs::write(folder.path("objects.obj"), OBJECTS).unwrap();
    let scene = "[[mesh]]\nfile = \"objects.obj\"\n[[mesh]]\nfile = \"objects.obj\"\ntranslate = [9, 0, 0]\n\
                 [[mesh]]\nfile = \"scene.obj\"\ntranslate = [0, 0, 9]\n";
    std::fs::write(folder.path("scene.toml"), scene).unwrap();
    let loaded = load(&folder.path("scene.toml"), &LoadOptions::default()).unwrap();
    let names = "Boden, lamp, left «é», right, Boden.2, lamp.2, left «é».2, right.2, scene";
    assert_eq!(loaded.object_names.join(", "), names);
    assert_eq!(
        loaded.triangle_objects,
        (0..8).chain([8, 8]).flat_map(|object| [object; 2]).collect::<Vec<_>>()
    );
}
