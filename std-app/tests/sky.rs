//! The sky of scene files: its light on a floor, the penumbra of its sun, and refusals.

use crate::support::Folder;
use halflight::Renderer;
use halflight::sky::{self, Dome};
use serde_json::Value;
use std::fs::write;

/// A floor with a wall of one unit at z = 0, open towards −z.
const FLOOR: &str = "v -50 0 -50\nv -50 0 50\nv 50 0 50\nv 50 0 -50\nf 1 2 3 4\n\
    v -20 0 0\nv 20 0 0\nv 20 1 0\nv -20 1 0\nf 5 6 7 8\n";

/// Irradiance of horizontal points of a scene with `keys` of its sky.
fn irradiance(name: &str, keys: &str, points: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let folder = Folder::new(name);
    write(folder.path("floor.obj"), FLOOR).unwrap();
    let scene = format!(
        "[[mesh]]\nfile = \"floor.obj\"\nmaterial = \"black\"\n\
        [material.black]\nkind = \"diffuse\"\ncolor = 0\n[sky]\n{keys}"
    );
    write(folder.path("sky.toml"), scene).unwrap();
    let lines = points.iter().map(|[x, y, z]| format!("{x} {y} {z} 0 1 0\n"));
    write(folder.path("points.pts"), lines.collect::<String>()).unwrap();
    let baked = folder.run("bake sky.toml --points points.pts --light direct --spp 4096");
    assert!(baked.status.success(), "{baked:?}");
    let table = String::from_utf8(baked.stdout).unwrap();
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        [numbers[6], numbers[7], numbers[8]]
    };
    table.lines().skip(1).map(row).collect()
}

/// Largest relative error of an irradiance: 4096 samples, and a map of 0.35 degrees.
const TOLERANCE: f64 = 0.004;

#[test]
fn a_floor_has_the_irradiance_of_the_sun_and_of_the_model() {
    for (elevation, turbidity) in [(60.0f64, 3.0), (25.0, 6.0)] {
        let (sin, cos) = elevation.to_radians().sin_cos();
        let keys = format!("sun = [{cos}, {sin}, 0]\nturbidity = {turbidity}\nground_albedo = 0.1\n");
        // Far behind the wall, which hides a millionth of the sky.
        let found = irradiance("sky-floor", &keys, &[[0.0, 0.5, -45.0]])[0];
        let of_sun = sky::irradiance(elevation, turbidity);
        let dome = Dome::new(elevation, turbidity, [0.1; 3], of_sun).unwrap();
        for i in 0..3 {
            let expected = dome.irradiance()[i] + sin * of_sun[i];
            assert!((found[i] / expected - 1.0).abs() < TOLERANCE, "{elevation} {i}: {found:?} {expected}");
        }
    }
}

#[test]
fn the_shadow_of_an_edge_has_the_penumbra_of_the_disc() {
    // The sun at 45 degrees beyond the wall: the shadow of its edge ends at z = -1, and the penumbra is
    // √2 · 2 · 0.2665 degrees along the ray, √2 as much along the floor: 0.0186 in all.
    let half = 0.0186 / 2.0;
    let at = |offset: f32| [0.0, 0.0, -1.0 + offset];
    let points = [at(-1.5 * half), at(-0.5 * half), at(0.0), at(0.5 * half), at(1.5 * half)];
    let found = irradiance("sky-edge", "sun = [0, 1, 1]\nturbidity = 2\n", &points);
    let [lit, dark] = [found[0][1], found[4][1]];
    // Fraction of a disc on one side of a chord at so many radii from the centre.
    let part = |x: f64| 0.5 + (x.asin() + x * (1.0 - x * x).sqrt()) / core::f64::consts::PI;
    for (i, x) in [(1, 0.5), (2, 0.0), (3, -0.5)] {
        let fraction = (found[i][1] - dark) / (lit - dark);
        assert!((fraction - part(x)).abs() < 0.02, "{i}: {fraction} {}", part(x));
    }
}

#[test]
fn date_and_place_give_the_sun_of_the_almanac() {
    // The example of the solar position algorithm: zenith angle 50.11162, azimuth 194.34024, with the sun of
    // the south at +z.
    let keys =
        "date = \"2003-10-17\"\ntime = \"12:30:30-07:00\"\nlatitude = 39.742476\nlongitude = -105.1786\n";
    let folder = Folder::new("sky-date");
    write(folder.path("sky.toml"), format!("[[mesh]]\nfile = \"scene.obj\"\n[sky]\n{keys}")).unwrap();
    let renderer = Renderer::open(folder.path("sky.toml")).unwrap();
    let disc = renderer.scene().environment.unwrap().disc.unwrap();
    let [x, y, z] = disc.direction.to_array().map(f64::from);
    let (elevation, azimuth) = (y.asin().to_degrees(), x.atan2(-z).to_degrees().rem_euclid(360.0));
    assert!((elevation - (90.0 - 50.11162)).abs() < 0.02, "{elevation}");
    assert!((azimuth - 194.34024).abs() < 0.02, "{azimuth}");
}

#[test]
fn up_and_north_turn_the_sky() {
    let sun = |keys: &str| {
        let folder = Folder::new("sky-axes");
        let place = "date = \"2024-03-20\"\ntime = \"09:00Z\"\nlatitude = 50\nlongitude = 0\n";
        write(folder.path("sky.toml"), format!("[[mesh]]\nfile = \"scene.obj\"\n[sky]\n{place}{keys}"))
            .unwrap();
        let renderer = Renderer::open(folder.path("sky.toml")).unwrap();
        let environment = renderer.scene().environment.unwrap();
        let sun = environment.disc.unwrap().direction;
        // The map has +y up.
        assert!((environment.to_map * sun).y > 0.3);
        sun
    };
    let [x, y, z] = sun("").to_array();
    assert!(x > 0.3 && y > 0.3 && z > 0.1, "a morning sun is in the south-east");
    let turned = sun("up = [0, 0, 2]\nnorth = [0, 3, 0]\n");
    assert!(turned.distance([x, -z, y].into()) < 1e-6, "{turned}");
}

#[test]
fn senseless_skies_are_refused_by_line_and_column() {
    let folder = Folder::new("sky-refused");
    let place = "date = \"2024-06-21\"\ntime = \"12:00Z\"\nlatitude = 47\nlongitude = 8\n";
    for (keys, message) in [
        ("turbidity = 3\n", "the position of the sun is unknown"),
        ("sun = [0, 0, 0]\n", "the direction of the sun is zero"),
        ("sun = [0, -1, 0]\n", "the sun is 90.00 degrees below the horizon"),
        ("sun = [0, 1, 0]\nlatitude = 5\n", "given in two ways"),
        ("sun = [0, 1, 0]\nup = [0, 1, 0]\nnorth = [0, 2, 0]\n", "are parallel"),
        ("sun = [0, 1, 0]\nturbidity = 0.5\n", "turbidity is 1 (pure air) to 10 (haze)"),
        ("sun = [0, 1, 0]\nground_albedo = 2\n", "is no reflectance"),
        ("sun = [0, 1, 0]\nintensity = 1e9\n", "`intensity` of the sky is larger than"),
        ("sun = [0, 1, 0]\n[environment]\nradiance = 1\n", "a [sky] and an [environment]"),
        (&place.replace("06-21", "06-31"), "the calendar has no such day"),
        (&place.replace("12:00Z", "12:00"), "no time of the day with an offset"),
        (&place.replace("12:00Z", "24:00Z"), "no time of the day with an offset"),
        (&place.replace("12:00Z", "00:00Z"), "below the horizon"),
        (&place.replace("47", "91"), "a latitude is"),
        (&format!("{place}moon = 1\n"), "unknown field `moon`"),
    ] {
        write(folder.path("sky.toml"), format!("[[mesh]]\nfile = \"scene.obj\"\n[sky]\n{keys}")).unwrap();
        let said = folder.refused("info sky.toml");
        assert!(said.contains(message) && said.contains("sky.toml:"), "{keys}: {said}");
    }
    // The map of the sky has a place in the budget.
    write(folder.path("sky.toml"), "[[mesh]]\nfile = \"scene.obj\"\n[sky]\nsun = [0, 1, 0]\n").unwrap();
    let said = folder.refused("render sky.toml --memory 4M --spp 1");
    assert!(said.contains("no room for the map of the sky"), "{said}");
}

#[test]
fn a_sky_lights_a_gltf_file() {
    let folder = Folder::new("sky-gltf");
    let triangle = "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAIA/AACAPwAAAAAAAAAA";
    let gltf = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}}}}]}}],\"accessors\":[{{\"bufferView\":0,\
         \"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,0,1]}}],\"bufferViews\":\
         [{{\"buffer\":0,\"byteLength\":36}}],\"buffers\":[{{\"byteLength\":36,\"uri\":\
         \"data:application/octet-stream;base64,{triangle}\"}}]}}"
    );
    write(folder.path("floor.gltf"), gltf).unwrap();
    let scene = "[[mesh]]\nfile = \"floor.gltf\"\n[camera]\neye = [0.3, 2, 0.3]\nlook_at = [0.3, 0, 0.3]\n\
        up = [0, 0, -1]\n[sky]\nsun = [1, 1, 0]\n";
    write(folder.path("sky.toml"), scene).unwrap();
    let object = folder.object("render sky.toml --spp 4 --size 16x16 -o sky.pfm --json");
    let mean = object["mean_radiance"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap());
    assert!(mean.into_iter().all(|light| light > 10.0), "{object}");
    assert_eq!(object["census"]["triangles"], Value::from(1));
}
