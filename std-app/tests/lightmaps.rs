//! Lightmaps by the program: values at known points, charts, texels inside bodies, refusals.

use crate::support::Folder;
use core::f64::consts::PI;
use exr::prelude::{RgbaChannels, Vec2, read_first_rgba_layer_from_file};

/// R, G, B, A of the texels of a map, in rows from the top.
pub(crate) struct Map {
    width: usize,
    texels: Vec<[f32; 4]>,
}

impl Map {
    pub(crate) fn read(folder: &Folder, name: &str) -> Self {
        let image = read_first_rgba_layer_from_file(
            folder.path(name),
            |size: Vec2<usize>, _: &RgbaChannels| (size, vec![[0f32; 4]; size.area()]),
            |(size, texels), at: Vec2<usize>, (r, g, b, a): (f32, f32, f32, f32)| {
                texels[at.y() * size.x() + at.x()] = [r, g, b, a];
            },
        )
        .unwrap();
        let (size, texels) = image.layer_data.channel_data.pixels;
        Self { width: size.x(), texels }
    }

    pub(crate) fn texel(&self, x: usize, y: usize) -> [f32; 4] {
        self.texels[y * self.width + x]
    }

    /// Bilinear fetch of red and of the least coverage at texture coordinates, as GPUs filter.
    pub(crate) fn fetch(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let height = self.texels.len() / self.width;
        let (x, y) = (u * self.width as f64 - 0.5, (1.0 - v) * height as f64 - 0.5);
        let (mut red, mut coverage) = (0.0, 1f64);
        for [i, j] in [[0, 0], [0, 1], [1, 0], [1, 1]] {
            let (column, row) = (x.floor() + f64::from(i), y.floor() + f64::from(j));
            let weight = (1.0 - (x - column).abs()) * (1.0 - (y - row).abs());
            let inside = |at: f64, side: usize| at.clamp(0.0, side as f64 - 1.0) as usize;
            let texel = self.texel(inside(column, self.width), inside(row, height));
            red += weight * f64::from(texel[0]);
            if weight > 0.0 {
                coverage = coverage.min(texel[3].into());
            }
        }
        [red, coverage]
    }

    fn with_coverage(&self, coverage: f32) -> impl Iterator<Item = &[f32; 4]> {
        self.texels.iter().filter(move |texel| texel[3] == coverage)
    }
}

pub(crate) const GREY: &str = "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n";

/// A folder with a mesh and its materials.
pub(crate) fn folder(name: &str, mesh: &str, materials: &str) -> Folder {
    let folder = Folder::new(name);
    std::fs::write(folder.path("scene.obj"), format!("mtllib scene.mtl\n{mesh}")).unwrap();
    std::fs::write(folder.path("scene.mtl"), materials).unwrap();
    folder
}

/// A floor from 0 to 2 in x and z, unwrapped to the whole square with v along -z, and a lamp at height 1 over
/// one of its corners.
fn floor() -> Folder {
    let mesh = "v 0 0 2\nv 2 0 2\nv 2 0 0\nv 0 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                usemtl grey\nf 1/1 2/2 3/3 4/4\n\
                v 0 1 0.5\nv 0 1 0\nv 1 1 0\nv 1 1 0.5\nusemtl lamp\nf 5 6 7 8\n";
    folder("lightmap-floor", mesh, GREY)
}

/// Irradiance at (x, 0, z) of the lamp of [`floor`], of radiance 1 and seen from below: signed rectangles
/// with a corner above the point.
pub(crate) fn below_the_lamp(x: f64, z: f64) -> f64 {
    let corner = |a: f64, b: f64| {
        let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        0.5 * (a / p * (b / p).atan() + b / q * (a / q).atan())
    };
    corner(1.0 - x, 0.5 - z) - corner(-x, 0.5 - z) - corner(1.0 - x, -z) + corner(-x, -z)
}

#[test]
fn a_value_of_the_map_is_the_irradiance_of_its_surface_point() {
    let folder = floor();
    let object = folder.object(
        "bake scene.obj --lightmap grey --size 64x48 --spp 256 -o map.exr -o map.hdr -o map.pfm --error-map \
         error.exr --json",
    );
    assert_eq!((&object["charts"], &object["texels"]["computed"]), (&1.into(), &(64 * 48).into()));
    let (map, error) = (Map::read(&folder, "map.exr"), Map::read(&folder, "error.exr"));
    for (i, j) in (0..400).map(|i| (i % 20, i / 20)) {
        let uv = [(f64::from(i) + 0.5) / 20.0, (f64::from(j) + 0.5) / 20.0];
        let truth = below_the_lamp(2.0 * uv[0], 2.0 - 2.0 * uv[1]);
        let [value, coverage] = map.fetch(uv);
        assert_eq!(coverage, 1.0);
        assert!((value - truth).abs() < 0.02 * truth + 0.002, "{uv:?}: {value} {truth}");
    }
    let mut held = 0;
    for (x, y) in (0..64 * 48).map(|i| (i % 64, i / 64)) {
        let truth = below_the_lamp((x as f64 + 0.5) / 32.0, (y as f64 + 0.5) / 24.0);
        let half_width = f64::from(error.texel(x, y)[0]);
        held += usize::from((f64::from(map.texel(x, y)[0]) - truth).abs() <= half_width);
    }
    assert!((0.92..0.995).contains(&(held as f64 / 3072.0)), "{held} of 3072 within the interval");
    for name in ["map.hdr", "map.pfm"] {
        let image = halflight::save::read(&folder.path(name)).unwrap();
        for (pixel, texel) in image.pixels.iter().zip(&map.texels) {
            assert!((pixel[0] - texel[0]).abs() <= texel[0] / 128.0, "{name}");
        }
    }
}

/// A closed box of radiance 2, seen from inside: walls of albedo ½ that emit 1. Its six sides are charts in
/// three columns and two rows.
pub(crate) fn furnace(name: &str) -> Folder {
    folder(name, &sides(), "newmtl wall\nKd 0.5 0.5 0.5\nKe 1 1 1\n")
}

fn sides() -> String {
    let mut mesh = String::new();
    for side in 0..6 {
        let (axis, sign) = (side / 2, [-1.0, 1.0][side % 2]);
        let (column, row) = (side as f64 % 3.0 / 3.0, (side / 3) as f64 / 2.0);
        for corner in 0..4 {
            // Counter-clockwise seen from inside.
            let [a, b] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]][corner];
            let mut place = [0.0; 3];
            (place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3]) = (sign, -sign * a, b);
            let [x, y, z] = place;
            let uv = [column + (0.5 + 0.4 * a) / 3.0, row + (0.5 + 0.4 * b) / 2.0];
            mesh += &format!("v {x} {y} {z}\nvt {} {}\n", uv[0], uv[1]);
        }
        let at = |corner: usize| format!("{0}/{0}", 4 * side + corner);
        mesh += &format!("usemtl wall\nf {} {} {} {}\n", at(1), at(2), at(3), at(4));
    }
    mesh
}

#[test]
fn fetches_inside_charts_read_computed_texels_alone() {
    let folder = furnace("lightmap-furnace");
    let object = folder.object(
        "bake scene.obj --lightmap all --size 91x57 --spp 96 --pad 1 -o map.exr --supersample 2 --json",
    );
    assert_eq!(object["charts"], 6);
    let map = Map::read(&folder, "map.exr");
    for number in 0..60_000 {
        let part = |i: u32| (f64::from(number) * [0.754_877_67, 0.569_840_29][i as usize]).fract();
        let (side, a, b) = (number % 6, 0.1 + 0.8 * part(0), 0.1 + 0.8 * part(1));
        let uv = [(f64::from(side % 3) + a) / 3.0, (f64::from(side / 3) + b) / 2.0];
        let [value, coverage] = map.fetch(uv);
        assert_eq!(coverage, 1.0, "{uv:?}");
        assert!((value / (2.0 * PI) - 1.0).abs() < 0.15, "{uv:?}: {value}");
    }
    let computed: Vec<f64> = map.with_coverage(1.0).map(|texel| texel[0].into()).collect();
    let mean = computed.iter().sum::<f64>() / computed.len() as f64;
    assert!((mean / (2.0 * PI) - 1.0).abs() < 0.003, "{mean}");
    assert!(map.with_coverage(0.5).count() > 100);
    assert!(map.with_coverage(0.5).all(|texel| (f64::from(texel[0]) / (2.0 * PI) - 1.0).abs() < 0.15));
    assert!(map.with_coverage(0.0).count() > 10 && map.with_coverage(0.0).all(|texel| texel[0] == 0.0));
}

#[test]
fn a_directional_map_is_linear_in_the_normal() {
    let folder = furnace("lightmap-directional");
    folder.object("bake scene.obj --lightmap all --size 24x16 --spp 256 --directional -o map.exr --json");
    let map = Map::read(&folder, "map.exr");
    assert_eq!(map.texels.len(), 24 * 16 * 4);
    folder.object(
        "bake scene.obj --lightmap all --size 24x16 --spp 256 --directional=godot -o g.exr -o g.hdr --json",
    );
    let godot = Map::read(&folder, "g.exr");
    // Light comes from the hemisphere above a wall: of a normal that is tilted by θ, (1 + cos θ) / 2 of it.
    let half = PI;
    for side in 0..6 {
        let [x, y] = [side % 3 * 8 + 2, 15 - (side / 3 * 8 + 5)];
        let texels = || (0..16).map(|i| [x + i % 4, y + i / 4]);
        let layer =
            |i: usize| texels().map(|[x, y]| f64::from(map.texel(x, y + 16 * i)[0])).sum::<f64>() / 16.0;
        let mut gradient = [0.0; 3];
        gradient[side / 2] = if side % 2 == 0 { half } else { -half };
        assert!((layer(0) - half).abs() < 0.3, "side {side}: {}", layer(0));
        for (axis, slope) in gradient.into_iter().enumerate() {
            assert!((layer(axis + 1) - slope).abs() < 0.35, "side {side}: {axis} {}", layer(axis + 1));
        }
        // Godot has y, z and x, from -1 to 1 as 0 to 1, relative to four times the constant.
        for [x, y] in texels() {
            let texel = |map: &Map, layer: usize| map.texel(x, y + 16 * layer)[0];
            assert!((texel(&godot, 0) - texel(&map, 0)).abs() < 1e-5 * texel(&map, 0));
            for (of_godot, layer) in [(1, 2), (2, 3), (3, 1)] {
                let slope = 4.0 * texel(&map, 0) * (2.0 * texel(&godot, of_godot) - 1.0);
                assert!((slope - texel(&map, layer)).abs() < 1e-4, "side {side}: {slope}");
            }
        }
    }
}

#[test]
fn meshes_of_a_scene_have_maps_of_their_own() {
    let folder = floor();
    let quad =
        "v 0 0.5 2\nv 1 0.5 2\nv 1 0.5 1\nv 0 0.5 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.path("shelf.obj"), quad).unwrap();
    let meshes = "[[mesh]]\nfile = \"scene.obj\"\n[[mesh]]\nfile = \"shelf.obj\"\n";
    std::fs::write(folder.path("both.toml"), meshes).unwrap();
    let said = folder.refused("bake both.toml --lightmap all --size 8x8 -o a.exr");
    assert!(said.contains("charts overlap in 64 texels"), "{said}");
    folder.object("bake both.toml --lightmap shelf --size 8x8 --spp 256 --light direct -o shelf.exr --json");
    folder.object("bake both.toml --lightmap grey --size 8x8 --spp 256 --light direct -o floor.exr --json");
    let mean = |name: &str| {
        let map = Map::read(&folder, name);
        map.texels.iter().map(|texel| f64::from(texel[0])).sum::<f64>() / 64.0
    };
    // The shelf has no material of its own, and is not below the lamp.
    assert!(mean("shelf.exr") > 0.001 && mean("shelf.exr") < 0.5 * mean("floor.exr"));
}

#[test]
fn texels_below_a_box_take_the_light_beside_it() {
    // A lamp over the whole floor, and a closed box on the middle of it.
    let mut mesh = "v 0 0 2\nv 2 0 2\nv 2 0 0\nv 0 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                    usemtl floor\nf 1/1 2/2 3/3 4/4\nv -9 1 -9\nv 9 1 -9\nv 9 1 9\nv -9 1 9\n\
                    usemtl lamp\nf 5 6 7 8\n"
        .to_owned();
    for corner in 0..8 {
        let [x, y, z] = [0, 1, 2].map(|axis| corner >> axis & 1);
        mesh += &format!("v {} {} {}\n", 0.5 + f64::from(x), 0.2 * f64::from(y), 0.5 + f64::from(z));
    }
    mesh += "usemtl box\nf 9 10 14 13\nf 11 15 16 12\nf 9 13 15 11\n";
    mesh += "f 10 12 16 14\nf 9 11 12 10\nf 13 14 16 15\n";
    let materials = "newmtl floor\nKd 0 0 0\nnewmtl box\nKd 0 0 0\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n";
    let folder = folder("lightmap-box", &mesh, materials);
    let object = folder.object("bake scene.obj --lightmap floor --size 32x32 --spp 64 -o map.exr --json");
    let map = Map::read(&folder, "map.exr");
    // The box covers a quarter of the floor.
    assert_eq!(object["texels"]["filled"], 256);
    for (x, y) in (0..1024).map(|i| (i % 32, i / 32)) {
        let is_below = (8..24).contains(&x) && (8..24).contains(&y);
        let [red, _, _, coverage] = map.texel(x, y);
        assert_eq!(coverage, if is_below { 0.5 } else { 1.0 }, "{x} {y}");
        assert!(red > 0.25 * 3.0, "{x} {y}: {red}");
    }
}

#[test]
fn needles_are_not_black() {
    // A floor as a fan of 1000 triangles, a thousandth as wide as they are long.
    let mut mesh = String::from("v 0 0 0\nvt 0.05 0.95\n");
    for i in 0..=1000 {
        let (x, z) = (f64::from(i.min(500)) / 500.0, f64::from((1000 - i).min(500)) / 500.0);
        mesh += &format!("v {x} 0 {z}\nvt {} {}\n", 0.05 + 0.9 * x, 0.95 - 0.9 * z);
    }
    mesh += "usemtl wall\n";
    (2..1002).for_each(|i| mesh += &format!("f 1/1 {0}/{0} {1}/{1}\n", i, i + 1));
    // A sky of radiance 1 beside surfaces of albedo ½ which emit ½ is a furnace.
    let folder = folder("lightmap-corner", &mesh, "newmtl wall\nKd 0.5 0.5 0.5\nKe 0.5 0.5 0.5\n");
    let scene = "[[mesh]]\nfile = \"scene.obj\"\n[environment]\nradiance = [1.0, 1.0, 1.0]\n";
    std::fs::write(folder.path("scene.toml"), scene).unwrap();
    folder.object("bake scene.toml --lightmap all --size 40x40 --spp 256 -o map.exr --json");
    let map = Map::read(&folder, "map.exr");
    assert!(map.with_coverage(1.0).count() > 1000);
    for texel in map.with_coverage(1.0) {
        assert!((f64::from(texel[0]) / PI - 1.0).abs() < 0.15, "{texel:?}");
    }
}

#[test]
fn maps_that_cannot_be_are_refused_before_the_work() {
    let folder = floor();
    let mesh = |name: &str, texcoords: &str, faces: &str| {
        let text = format!("v 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\n{texcoords}{faces}");
        std::fs::write(folder.path(name), text).unwrap();
    };
    let square = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    mesh("bare.obj", "", "f 1 2 3\n");
    mesh("flat.obj", "vt 0.5 0.5\n", "f 1/1 2/1 3/1\n");
    mesh("twice.obj", square, "f 1/1 2/2 3/3\nf 4/1 1/2 2/3\n");
    mesh("outside.obj", "vt 0 0\nvt 1.5 0\nvt 1 1\n", "f 1/1 2/2 3/3\n");
    for (arguments, message) in [
        ("bare.obj --lightmap all --size 8x8 -o a.exr", "bare.obj: has no texture coordinates"),
        ("flat.obj --lightmap all --size 8x8 -o a.exr", "flat.obj: has no area in texture coordinates"),
        (
            "twice.obj --lightmap all --size 8x8 -o a.exr",
            "twice.obj: charts overlap in 36 texels, the first at",
        ),
        (
            "outside.obj --lightmap all --size 8x8 -o a.exr",
            "1 triangle has texture coordinates outside 0 to 1",
        ),
        ("scene.obj --lightmap all --size 8x8 -o a.png", "a.png: a PNG has no room for light"),
        ("scene.obj --lightmap all --size 8x8 --directional -o a.hdr", "an HDR has no negative values"),
        ("scene.obj --lightmap wall --size 8x8 -o a.exr", "no mesh, object or material is called `wall`"),
        ("scene.obj --lightmap all --size 16384x16384 -o a.exr --memory 1G", "the lightmap is too large"),
        ("scene.obj --lightmap all --size 16384x16384 -o a.exr --directional", "more than 268435456 texels"),
        ("scene.obj --lightmap all --size 8x8", "--lightmap has no output"),
        ("scene.obj --lightmap all -o a.exr", "--size"),
        ("scene.obj --lightmap all --size 8x8 -o a.exr --error-map a.exr", "(--error-map) is the same file"),
        ("scene.obj --vertices --size 8x8 -o a.csv", "cannot be used with '--size"),
    ] {
        let said = folder.refused(&format!("bake {arguments}"));
        assert!(said.contains(message), "{arguments}: {said}");
    }
    assert!(!folder.path("a.exr").exists());
}

#[test]
fn an_object_has_a_map_of_its_own() {
    // Two squares in one material: their charts overlap, and only together.
    let square = |name: &str, y: u32, first: u32| {
        let corners = format!("v 0 {y} 2\nv 2 {y} 2\nv 2 {y} 0\nv 0 {y} 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n");
        let face: String = (first..first + 4).map(|i| format!(" {i}/{i}")).collect();
        format!("o {name}\n{corners}usemtl grey\nf{face}\n")
    };
    let lamp = "o sun\nv 0 4 2\nv 0 4 0\nv 2 4 0\nv 2 4 2\nusemtl lamp\nf 9 10 11 12\n";
    let mesh = format!("{}{}{lamp}", square("shelf", 1, 1), square("ground", 0, 5));
    let folder = folder("lightmap-object", &mesh, GREY);
    let said = folder.refused("bake scene.obj --lightmap grey --size 8x8 -o a.exr");
    assert!(said.contains("overlap"), "{said}");
    let red = |name: &str| {
        let bake =
            format!("bake scene.obj --lightmap {name} --size 8x8 --spp 64 --light direct -o {name}.exr");
        folder.object(&format!("{bake} --json"));
        Map::read(&folder, &format!("{name}.exr")).texel(4, 4)[0]
    };
    // The shelf is below the lamp, and covers the ground.
    let [shelf, ground] = ["shelf", "ground"].map(red);
    assert!(shelf > 0.3 && ground == 0.0, "{shelf} {ground}");
}

#[test]
fn a_map_in_parts_has_the_bits_of_one() {
    let folder = furnace("lightmap-parts");
    let bake = "bake scene.obj --lightmap all --size 24x16 --unit white --directional --json";
    let whole =
        folder.object(&format!("{bake} --spp 24 -o whole.exr --error-map whole-error.exr --threads 1"));
    for shard in 1..=3 {
        folder.object(&format!("{bake} --spp 24 --shard {shard}/3 --checkpoint {shard}.bake"));
    }
    let merged =
        folder.object("merge 3.bake 1.bake 2.bake -o merged.exr --error-map merged-error.exr --json");
    assert_eq!((&merged["texels"], &merged["charts"]), (&whole["texels"], &6.into()));
    // A bake that ended early goes on.
    for spp in [5, 24] {
        folder.object(&format!("{bake} --spp {spp} --continue a.bake -o a.exr --error-map a-error.exr"));
    }
    let bytes = |name: &str| std::fs::read(folder.path(name)).unwrap();
    for name in ["merged", "a"] {
        assert!(bytes(&format!("{name}.exr")) == bytes("whole.exr"), "{name}");
        assert!(bytes(&format!("{name}-error.exr")) == bytes("whole-error.exr"), "{name}");
    }
    for (arguments, reason) in [
        ("merge 1.bake 2.bake 3.bake -o no.csv", "no.csv"),
        ("merge 1.bake 2.bake 3.bake -o no.hdr", "an HDR has no negative values"),
        ("merge 1.bake 2.bake 3.bake -o 1.bake", "1.bake"),
        ("merge 1.bake 3.bake -o no.exr", "shard 2/3 is missing"),
        (
            "bake scene.obj --lightmap all --size 24x16 --spp 24 --continue a.bake -o no.exr",
            "a.bake: is a bake of points 1536",
        ),
        (
            "bake scene.obj --lightmap all --size 24x16 --method auto --spp 4 --shard 1/2 --checkpoint b.bake",
            "the audit that keeps or leaves it needs points of all shards",
        ),
    ] {
        let said = folder.refused(arguments);
        assert!(said.contains(reason), "{arguments}: {said}");
    }
    assert!(!folder.path("no.exr").exists() && !folder.path("no.csv").exists());
}
