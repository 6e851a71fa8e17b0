//! Forest for measurements of instances: trees of about 100,000 triangles that are placed many times.
//!
//! `cargo run --release -p halflight-tests --example forest -- FOLDER [TREES [TRIANGLES [KINDS]]]`, by
//! default 1000 trees of 100,000 triangles and 4 kinds. Writes `forest.toml`, where the trees share their
//! memory, and `copies.toml`, where they do not, with the meshes and materials. Then for example
//! `halflight render FOLDER/forest.toml --spp 16 -o forest.exr --json`.

use core::f64::consts::{PI, TAU};
use core::fmt::Write;
use std::path::Path;
use std::{env, fs, io};

type Vector = [f64; 3];

/// Side of the ground for each square root of the number of trees, in metres.
const SPACING: f64 = 4.0;

/// Sides of a branch.
const SIDES: usize = 5;

/// Linear congruential generator (Knuth, MMIX).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

fn add(a: Vector, b: Vector, factor: f64) -> Vector {
    [0, 1, 2].map(|i| a[i] + factor * b[i])
}

fn cross(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

fn unit(a: Vector) -> Vector {
    let length = a.iter().map(|x| x * x).sum::<f64>().sqrt();
    a.map(|x| x / length)
}

/// Two unit vectors at right angles to `along` and to each other.
fn sides(along: Vector) -> [Vector; 2] {
    let first = unit(cross(along, if along[0].abs() < 0.5 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }));
    [first, cross(along, first)]
}

/// Mesh of a tree as text of an OBJ file: branches, then leaves.
struct Tree {
    random: Random,
    vertices: Vec<Vector>,
    wood: Vec<[usize; 3]>,
    leaves: Vec<[usize; 3]>,
    /// Leaves at the end of a branch.
    leaves_of_end: usize,
}

impl Tree {
    /// A tree of about `triangles` triangles.
    fn new(triangles: usize, seed: u64) -> Self {
        // Each branch has three others: 3^depth ends.
        let depth = (triangles as f64 / 300.0).ln() / 3f64.ln();
        let depth = depth.max(1.0) as u32;
        let branches: usize = (0..=depth).map(|level| 3usize.pow(level)).sum();
        let leaves = triangles.saturating_sub(2 * SIDES * branches) / 2;
        let leaves_of_end = leaves.div_ceil(3usize.pow(depth));
        let (random, vertices) = (Random(seed), Vec::new());
        let mut tree = Self { random, vertices, wood: Vec::new(), leaves: Vec::new(), leaves_of_end };
        tree.branch([0.0; 3], [0.0, 1.0, 0.0], 1.8, 0.12, depth);
        tree
    }

    fn branch(&mut self, from: Vector, along: Vector, length: f64, radius: f64, depth: u32) {
        let to = add(from, along, length);
        self.cylinder([from, to], along, [radius, 0.7 * radius]);
        if depth == 0 {
            return (0..self.leaves_of_end).for_each(|_| self.leaf(from, to));
        }
        let turn = self.random.between(0.0, TAU);
        for i in 0..3 {
            let angle = turn + TAU * f64::from(i) / 3.0 + self.random.between(-0.3, 0.3);
            let tilt = self.random.between(0.3, 0.8);
            let [u, v] = sides(along);
            let aside = add(u.map(|x| x * angle.cos()), v, angle.sin());
            let direction = unit(add(along.map(|x| x * tilt.cos()), aside, tilt.sin()));
            let start = add(from, along, length * self.random.between(0.6, 1.0));
            let length = length * self.random.between(0.6, 0.8);
            self.branch(start, direction, length, 0.6 * radius, depth - 1);
        }
    }

    fn cylinder(&mut self, ends: [Vector; 2], along: Vector, radii: [f64; 2]) {
        let [u, v] = sides(along);
        let first = self.vertices.len();
        for (end, radius) in ends.into_iter().zip(radii) {
            for i in 0..SIDES {
                let angle = TAU * i as f64 / SIDES as f64;
                self.vertices.push(add(add(end, u, radius * angle.cos()), v, radius * angle.sin()));
            }
        }
        for i in 0..SIDES {
            let [a, b] = [first + i, first + (i + 1) % SIDES];
            self.wood.extend([[a, b, b + SIDES], [a, b + SIDES, a + SIDES]]);
        }
    }

    /// A leaf of two triangles near a branch.
    fn leaf(&mut self, from: Vector, to: Vector) {
        let at = self.random.unit();
        let mut place = [0, 1, 2].map(|i| from[i] + at * (to[i] - from[i]));
        place = place.map(|x| x + self.random.between(-0.15, 0.15));
        let (z, angle) = (self.random.between(-1.0, 1.0), self.random.between(0.0, 2.0 * PI));
        let r = (1.0 - z * z).sqrt();
        let normal = [r * angle.cos(), r * angle.sin(), z];
        let ([u, v], first) = (sides(normal), self.vertices.len());
        let size = self.random.between(0.03, 0.06);
        let tips = [
            add(place, u, size),
            add(place, v, 0.5 * size),
            add(place, u, -size),
            add(place, v, -0.5 * size),
        ];
        self.vertices.extend(tips);
        self.leaves.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }

    fn text(&self) -> String {
        let mut text = String::from("mtllib forest.mtl\n");
        for [x, y, z] in &self.vertices {
            let _ = writeln!(text, "v {x:.5} {y:.5} {z:.5}");
        }
        for (name, faces) in [("wood", &self.wood), ("leaf", &self.leaves)] {
            let _ = writeln!(text, "usemtl {name}");
            for face in faces {
                let [a, b, c] = face.map(|vertex| vertex + 1);
                let _ = writeln!(text, "f {a} {b} {c}");
            }
        }
        text
    }
}

const MATERIALS: &str =
    "newmtl wood\nKd 0.25 0.17 0.1\nnewmtl leaf\nKd 0.12 0.3 0.06\nnewmtl soil\nKd 0.2 0.15 0.1\n";

/// The scene file of `trees` trees of `kinds` kinds.
fn scene(trees: usize, kinds: usize, share: bool) -> String {
    let mut random = Random(7);
    let columns = (trees as f64).sqrt().ceil() as usize;
    let side = SPACING * columns as f64;
    let mut text = String::from("[[mesh]]\nfile = \"ground.obj\"\n");
    let _ = writeln!(text, "scale = {side:.1}");
    for kind in 0..kinds {
        let _ = writeln!(text, "\n[[mesh]]\nfile = \"tree-{kind}.obj\"\nshare = {share}\ninstances = [");
        for i in (kind..trees).step_by(kinds) {
            let [x, z] = [i % columns, i / columns]
                .map(|cell| SPACING * (cell as f64 + random.between(0.1, 0.9)) - 0.5 * side);
            let (scale, degrees) = (random.between(0.7, 1.3), random.between(0.0, 360.0));
            let _ = writeln!(
                text,
                "  {{ scale = {scale:.3}, rotate = {{ axis = [0, 1, 0], degrees = {degrees:.1} }}, translate = [{x:.3}, 0, {z:.3}] }},"
            );
        }
        text.push_str("]\n");
    }
    let _ = write!(
        text,
        "\n[environment]\nradiance = [0.7, 0.85, 1.0]\n\n[[light]]\nkind = \"directional\"\n\
         direction = [-0.5, -1, -0.4]\nirradiance = [4, 3.6, 3]\n\n\
         [camera]\neye = [0, {:.1}, {:.1}]\nlook_at = [0, 1.5, 0]\nfov = 45\n\n\
         [render]\nsize = [640, 360]\nmax_depth = 6\nmethod = \"path\"\n",
        3.0 + 0.2 * side,
        0.65 * side,
    );
    text
}

fn main() -> io::Result<()> {
    let mut arguments = env::args().skip(1);
    let folder = arguments.next().ok_or(io::Error::other("give a folder to write to"))?;
    let mut number = |default: usize| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(default);
    let (trees, triangles, kinds) = (number(1000), number(100_000), number(4));
    let folder = Path::new(&folder);
    fs::create_dir_all(folder)?;
    for kind in 0..kinds {
        fs::write(folder.join(format!("tree-{kind}.obj")), Tree::new(triangles, kind as u64 + 1).text())?;
    }
    let ground = "mtllib forest.mtl\nusemtl soil\nv -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n";
    fs::write(folder.join("ground.obj"), ground)?;
    fs::write(folder.join("forest.mtl"), MATERIALS)?;
    fs::write(folder.join("forest.toml"), scene(trees, kinds, true))?;
    fs::write(folder.join("copies.toml"), scene(trees, kinds, false))
}
