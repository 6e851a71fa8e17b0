//! Frequencies of lights chosen by descents of the tree.

use super::*;
use crate::geometry::{Bounds, Cone};
use crate::memory::Line;
use crate::sampling::Random;
use std::vec;
use std::vec::Vec;

/// Lights at the positions of `place`, with random emission.
fn items(count: u32, place: impl Fn(&Random, u32) -> Vec3) -> Vec<Item> {
    let random = Random::new(3, count);
    let item = |i: u32| {
        let [u, v, cos, power] = [0, 1, 2, 3].map(|k| random.single(1_000_000 + 4 * i + k));
        let axis = crate::sampling::warp::uniform_cone([u, v], 2.0).to_array();
        let cone = if i.is_multiple_of(5) { Cone::ALL } else { Cone { axis, cos } };
        let center = place(&random, i);
        Item::new(&Bounds { min: center - 0.01, max: center + 0.01 }, cone, power + 0.01, i)
    };
    (0..count).map(item).collect()
}

fn with_tree(mut items: Vec<Item>, then: impl FnOnce(&Tree, usize)) {
    let count = items.len();
    // Left over from an earlier use: groups without lights would have a power of 1.
    let left_over = Line(bytemuck::cast([1.0f32; 16]));
    let mut lines = vec![left_over; Tree::footprint(count).bytes() / 64];
    let (nodes, trails) = Tree::memory(count, &mut Arena::over(&mut lines)).unwrap();
    then(&Tree::build(&mut items, nodes, trails), count);
}

#[test]
fn lights_are_found_as_often_as_is_said() {
    let even = |random: &Random, i: u32| Vec3::from([0, 1, 2].map(|k| random.single(3 * i + k)));
    let on_a_line = |_: &Random, i: u32| Vec3::X * libm::powf(0.7, i as f32);
    let all_at_once = |_: &Random, _: u32| Vec3::ONE;
    let mut cases = Vec::new();
    for count in [0, 1, 2, 3, 7, 8, 9, 16, 17, 64, 100, 513] {
        cases.extend([items(count, even), items(count, on_a_line), items(count, all_at_once)]);
    }
    let random = Random::new(4, 4);
    for (case, items) in cases.into_iter().enumerate() {
        with_tree(items, |tree, count| {
            for i in 0..20 {
                let [x, y, z, u, v] = [0, 1, 2, 3, 4].map(|k| random.single(200 * case as u32 + 5 * i + k));
                let point = 4.0 * Vec3::new(x, y, z) - 1.5;
                let normal =
                    if i % 4 == 0 { Vec3::ZERO } else { crate::sampling::warp::uniform_cone([u, v], 2.0) };
                let densities: Vec<f32> =
                    (0..count as u32).map(|light| tree.pdf(point, normal, light)).collect();
                let sum: f32 = densities.iter().sum();
                let steps = 256;
                let mut found = 0;
                for step in 0..steps {
                    let u = (step as f32 + 0.5) / steps as f32;
                    let drawn = tree.sample(point, normal, u);
                    found += u32::from(drawn.is_some());
                    let Some((light, probability, left)) = drawn else { continue };
                    assert_eq!(probability, densities[light as usize]);
                    assert!(probability > 0.0 && (0.0..1.0).contains(&left));
                    for level in Level::detect().and_below() {
                        let same = tree.with_level(level);
                        assert_eq!(same.sample(point, normal, u), drawn);
                        assert_eq!(same.pdf(point, normal, light), probability);
                    }
                }
                // The importance of a group may exceed that of its members: the difference is the
                // probability of `None`.
                let share = found as f32 / steps as f32;
                assert!((sum - share).abs() < 0.02 && sum < 1.0 + 1e-4, "{case} {i}: {sum} {share}");
            }
        });
    }
}

#[test]
fn blocks_choose_the_lights_of_their_vertices() {
    let random = Random::new(5, 5);
    for count in [0, 1, 2, 9, 300] {
        with_tree(
            items(count, |random, i| Vec3::from([0, 1, 2].map(|k| random.single(3 * i + k)))),
            |tree, _| {
                for round in 0..50 {
                    let number = |k: u32, i: u32| random.single(1000 * round + 16 * k + i);
                    let row = |k: u32| -> Row { core::array::from_fn(|i| 4.0 * number(k, i as u32) - 1.5) };
                    let points = [row(0), row(1), row(2)];
                    let mut normals = [[0.0; BLOCK], [0.0; BLOCK], [1.0; BLOCK]];
                    normals[2][3] = 0.0;
                    let u = core::array::from_fn(|i| number(3, i as u32));
                    let active = 0xfb7f;
                    for level in Level::detect().and_below() {
                        let chosen = tree.with_level(level).sample_block((&points, &normals), &u, active);
                        for i in 0..BLOCK {
                            let point = Vec3::from(shade::at(&points, i));
                            let normal = Vec3::new(0.0, 0.0, normals[2][i]);
                            let alone = tree.sample(point, normal, u[i]).filter(|_| active >> i & 1 == 1);
                            let found = (chosen.exists >> i & 1 == 1)
                                .then_some((chosen.lights[i], chosen.probabilities[i]));
                            assert_eq!(found, alone.map(|(light, probability, _)| (light, probability)));
                        }
                    }
                }
            },
        );
    }
}

#[test]
fn all_lights_are_visited_once_but_those_of_groups_that_are_ruled_out() {
    for count in [0, 1, 2, 9, 100] {
        with_tree(items(count, |random, i| Vec3::X * random.single(i)), |tree, count| {
            let mut seen = vec![0; count];
            tree.visit(|_, _| true, |light| seen[light as usize] += 1);
            assert!(seen.iter().all(|times| *times == 1));
            tree.visit(|_, _| false, |_| panic!("ruled out"));
        });
    }
}
