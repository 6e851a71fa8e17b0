//! Properties of the rays of each class.

use super::*;
use crate::load::{LoadOptions, load};
use crate::pages::Pages;
use halflight_core::Level;
use halflight_core::scene::Camera;

/// Runs `check` on the Cornell box of the repository.
fn in_cornell_box(check: impl FnOnce(&Scene, &halflight_core::bvh::Bvh)) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/cornell/cornell.obj");
    let loaded = load(file.as_ref(), &LoadOptions::default()).unwrap();
    let views = loaded.views();
    let camera: Camera = loaded.camera_or_default();
    let mut memory = Pages::default();
    let scene = views.scene(camera);
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
