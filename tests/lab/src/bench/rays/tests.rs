//! Properties of the rays of each class, and hits of other libraries.

use super::classes::{self, Class, Rays};
use super::{measure, ours};
use halflight::load::{LoadOptions, load};
use halflight::pages::Pages;
use halflight_core::Level;
use halflight_core::bvh::Bvh;
use halflight_core::scene::Scene;

/// Width and height of the picture.
const SIZE: [u32; 2] = [1024; 2];

/// Runs `check` on the Cornell box of the repository.
fn in_cornell_box(check: impl FnOnce(&Scene, &Bvh)) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/cornell/cornell.obj");
    let loaded = load(file.as_ref(), &LoadOptions::default()).unwrap();
    let views = loaded.views();
    let mut memory = Pages::default();
    let scene = views.scene(loaded.camera_or_default());
    let bvh = ours::build(&scene.mesh, Level::detect(), &mut memory).unwrap();
    check(&scene, &bvh);
}

#[test]
fn diffuse_rays_are_cosine_distributed() {
    in_cornell_box(|scene, bvh| {
        let level = Level::detect();
        let rays = Rays::of(scene, bvh, level, SIZE).unwrap();
        let [primary, diffuse, shadow] = Class::ALL.map(|class| rays.of_class(class));
        let mut bounces = diffuse.iter();
        let (mut cosines, mut count) = (0.0, 0);
        for ray in primary {
            let hit = bvh.nearest(level, ray);
            if !hit.is_some() {
                continue;
            }
            let bounce = bounces.next().unwrap();
            let [a, b, c] = scene.mesh.corners(hit.triangle);
            let normal = (b - a).cross(c - a).normalize();
            let cosine = normal.dot(bounce.direction.into()).abs();
            cosines += f64::from(cosine);
            count += 1;
            if count % 101 == 0 {
                assert!(
                    bvh.nearest(level, bounce).triangle != hit.triangle,
                    "a ray hits the triangle that it leaves"
                );
            }
        }
        assert!(bounces.next().is_none());
        // E[cos] = 2/3, Var[cos] = 1/18; five standard deviations: one failure in two million tries.
        let deviation = (1.0 / 18.0 / f64::from(count)).sqrt();
        assert!((cosines / f64::from(count) - 2.0 / 3.0).abs() < 5.0 * deviation);
        let quarter = 0.25 * bvh.bounds().diagonal();
        assert!(shadow.len() == diffuse.len() && shadow.iter().all(|ray| ray.t_max == quarter));
    });
}

#[test]
fn tiles_cover_every_pixel_once() {
    for size in [SIZE, [8, 8], [13, 9], [1, 20], [20, 1]] {
        let mut visits = vec![0; (size[0] * size[1]) as usize];
        classes::pixels(size).for_each(|[x, y]| visits[(y * size[0] + x) as usize] += 1);
        assert!(visits.iter().all(|&count| count == 1), "{size:?}");
    }
    assert_eq!(classes::pixels(SIZE).nth(64 + 9), Some([9, 1]));
    assert_eq!(classes::pixels([13, 9]).nth(64 + 5), Some([8, 1]), "the second tile has five columns");
}

/// Fraction of rays that may differ: Embree's triangle test is not watertight and rounds differently.
const DIFFERENT: f64 = 1e-4;

#[test]
fn every_entry_point_of_a_rival_has_our_hits() {
    in_cornell_box(|scene, _| {
        // 10,201 rays: no multiple of a packet size.
        let report = measure::measure(scene, Level::detect(), [101; 2]).unwrap();
        assert_eq!(report.rivals.len(), usize::from(cfg!(feature = "embree")));
        let classes = report.rivals.iter().flat_map(|rival| report.classes.iter().zip(&rival.classes));
        for (ours, entries) in classes {
            assert_eq!(entries.len(), 6);
            for theirs in entries {
                let difference = theirs.hits.abs_diff(ours.hits) as f64;
                assert!(difference <= DIFFERENT * ours.rays as f64, "{}: {difference}", theirs.entry);
            }
        }
    });
}
