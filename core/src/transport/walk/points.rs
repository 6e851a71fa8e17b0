//! Surface points of a block of sixteen hits, with the texels of their colours: computed in lanes, with the
//! bits of [`SurfacePoint::at`] and [`Bsdf::at`]. Normal maps and degenerate triangles are computed one by
//! one.

use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::geometry::{Frame, Hit, Ray};
use crate::scene::{Attributes, Material, Scene, SurfacePoint, load};
use crate::transport::walk::context::SceneContext;
use bytemuck::Zeroable;
use glam::{Vec2, Vec3};
use halflight_simd::kernels::shade::surface::{SurfaceBlock, Surfaces};
use halflight_simd::kernels::shade::texture::TextureBlock;
use halflight_simd::kernels::shade::{BLOCK, Row, Row3, at, put};

/// Surface points of a block. Rows of other hits keep old values.
pub(crate) struct PointBlock<'a> {
    corners: [Row3; 3],
    normals: [Row3; 3],
    weights: [Row; 2],
    pub(crate) surface: SurfaceBlock,
    pub(crate) triangle: [u32; BLOCK],
    pub(crate) material: [&'a Material; BLOCK],
    attributes: [Attributes; BLOCK],
    textures: TextureBlock,
    /// Set of hits whose colours were looked up in lanes, and their texels.
    textured: u32,
    texel: Row3,
    /// Set of hits of instances, with texture coordinates and the error that the transform adds.
    placed: u32,
    texcoords: [[Vec2; 3]; BLOCK],
    more_error: Row,
    /// Set of hits with a point, by [`PointBlock::meet`].
    pub(crate) met: u32,
}

static GREY: Material = Material::GREY;

impl<'a> PointBlock<'a> {
    /// Without points.
    pub(crate) fn new() -> Self {
        Self {
            corners: [[[0.0; BLOCK]; 3]; 3],
            normals: [[[0.0; BLOCK]; 3]; 3],
            weights: [[0.0; BLOCK]; 2],
            surface: SurfaceBlock::EMPTY,
            triangle: [0; BLOCK],
            material: [&GREY; BLOCK],
            attributes: [Attributes::NONE; BLOCK],
            textures: TextureBlock::EMPTY,
            textured: 0,
            texel: [[0.0; BLOCK]; 3],
            placed: 0,
            texcoords: [[Vec2::ZERO; 3]; BLOCK],
            more_error: [0.0; BLOCK],
            met: 0,
        }
    }

    /// Collects the triangle of `hit` as number `i`. False if the scene has no such triangle.
    #[inline]
    pub(crate) fn gather(&mut self, scene: &Scene<'a>, i: usize, hit: &Hit) -> bool {
        let (mesh, i) = (&scene.mesh, i & 15);
        let Some(triangle) = mesh.triangles.get(hit.triangle as usize) else {
            return self.gather_of_instance(scene, i, hit);
        };
        let Some(material) = scene.materials.get(triangle.material as usize) else { return false };
        let [a, b, c] = triangle.vertices;
        let corner = |vertex: u32| mesh.positions.get(vertex as usize);
        let (Some(&p0), Some(&p1), Some(&p2)) = (corner(a), corner(b), corner(c)) else { return false };
        put(&mut self.corners[0], i, p0);
        put(&mut self.corners[1], i, p1);
        put(&mut self.corners[2], i, p2);
        if mesh.has_normals() {
            let normal = |vertex: u32| mesh.normals.get(vertex as usize).copied().unwrap_or_default();
            put(&mut self.normals[0], i, normal(a));
            put(&mut self.normals[1], i, normal(b));
            put(&mut self.normals[2], i, normal(c));
        }
        (self.weights[0][i], self.weights[1][i]) = (hit.u, hit.v);
        (self.triangle[i], self.material[i]) = (hit.triangle, material);
        self.placed &= !(1 << i);
        true
    }

    /// [`PointBlock::gather`] of a triangle that is not in world space.
    #[inline(never)]
    fn gather_of_instance(&mut self, scene: &Scene<'a>, i: usize, hit: &Hit) -> bool {
        let Some(triangle) = scene.mesh.placed_triangle(hit.triangle) else { return false };
        let Some(material) = scene.materials.get(triangle.material as usize) else { return false };
        for k in 0..3 {
            put(&mut self.corners[k], i, triangle.positions[k]);
            put(&mut self.normals[k], i, triangle.normals[k]);
        }
        (self.weights[0][i], self.weights[1][i]) = (hit.u, hit.v);
        (self.triangle[i], self.material[i]) = (hit.triangle, material);
        self.texcoords[i] = triangle.texcoords.map(Vec2::from);
        self.more_error[i] = triangle.error;
        self.placed |= 1 << i;
        true
    }

    /// Computes the points of the `hits` of `rays`, at most sixteen.
    #[inline]
    pub(crate) fn meet<F: Features>(
        &mut self,
        context: &SceneContext<'a, F>,
        (rays, hits): (&[Ray], &[Hit]),
    ) {
        let mut met = 0;
        for (i, hit) in hits.iter().enumerate() {
            met |= u32::from(hit.is_some() && self.gather(context.scene, i, hit)) << i;
        }
        self.met = if met == 0 { 0 } else { self.compute(context, (rays, hits), met) };
    }

    /// Computes the points of the gathered set `met` of `hits` of `rays`, at most sixteen. Returns the set of
    /// hits with a point.
    #[inline]
    pub(crate) fn compute<F: Features>(
        &mut self,
        context: &SceneContext<'a, F>,
        (rays, hits): (&[Ray], &[Hit]),
        mut met: u32,
    ) -> u32 {
        self.textured = 0;
        let special = if context.has_lanes() { self.compute_in_lanes(context, rays, met) } else { met };
        for i in Set(special) {
            let (Some(ray), Some(hit)) = (rays.get(i), hits.get(i)) else { continue };
            match context.surface_at(ray, hit) {
                Some(point) => self.put_point(i, &point, Vec3::from(ray.direction)),
                None => met &= !(1 << i),
            }
        }
        met
    }

    /// Computes the points of `met` in lanes. Returns the set of those that have to be computed one by one.
    #[inline]
    fn compute_in_lanes<F: Features>(
        &mut self,
        context: &SceneContext<'a, F>,
        rays: &[Ray],
        met: u32,
    ) -> u32 {
        let scene = context.scene;
        let mut copies = [Ray::zeroed(); BLOCK];
        let whole: &[Ray] = if rays.len() < BLOCK {
            copies.iter_mut().zip(rays).for_each(|(copy, ray)| *copy = *ray);
            &copies
        } else {
            rays
        };
        let records: &[[f32; 8]] = bytemuck::cast_slice(whole);
        let Some(records) = records.first_chunk() else { return met };
        let surfaces = Surfaces {
            corners: &self.corners,
            normals: scene.mesh.has_normals().then_some(&self.normals),
            weights: &self.weights,
            rays: records,
        };
        surfaces.compute(context.level, &mut self.surface);
        Set(met & self.placed).for_each(|i| self.surface.error[i] += self.more_error[i]);
        if (F::TEXTURES || F::NORMAL_MAPS || F::CUTOUT) && scene.has_attributes() {
            for i in Set(met) {
                let t = match self.placed >> i & 1 {
                    0 => scene.mesh.corner_texcoords(self.triangle[i]),
                    _ => self.texcoords[i],
                };
                let (u, v) = (self.weights[0][i], self.weights[1][i]);
                self.attributes[i].uv[0] = (1.0 - u - v) * t[0] + u * t[1] + v * t[2];
            }
            if scene.mesh.has_more_attributes() {
                for i in Set(met) {
                    let weights = [self.weights[0][i], self.weights[1][i]];
                    scene.mesh.add_attributes(self.triangle[i], weights, &mut self.attributes[i]);
                }
            }
            if F::TEXTURES {
                self.look_up_colors(context, met);
            }
        }
        let mut special = met & !self.surface.regular;
        if F::NORMAL_MAPS {
            let mapped = |i: &usize| self.material[*i].normal_map.is_some();
            special |= Set(met).filter(mapped).fold(0, |set, i| set | 1 << i);
        }
        special
    }

    /// Looks up the textures of the colours at the hits `met`. Their accesses to memory overlap.
    #[inline]
    fn look_up_colors<F: Features>(&mut self, context: &SceneContext<'a, F>, met: u32) {
        let scene = context.scene;
        let mut texels: [(&[[u8; 4]], usize); BLOCK] = [(&[], 0); BLOCK];
        for i in Set(met) {
            let id = self.material[i].surface.color().and_then(|color| color.texture);
            let Some(texture) = id.and_then(|id| scene.textures.get(id.0 as usize)) else { continue };
            if let Some(found) = texture.put(&mut self.textures, i, texture.uv(&self.attributes[i])) {
                texels[i] = found;
                self.textured |= 1 << i;
            }
        }
        if self.textured != 0 {
            self.textures.surround(context.level);
            Set(self.textured).for_each(|i| load(&mut self.textures, i, texels[i]));
            self.textures.mix(context.level, &mut self.texel);
        }
    }

    /// Stores a surface point computed without lanes, viewed along `direction`.
    fn put_point(&mut self, i: usize, point: &SurfacePoint, direction: Vec3) {
        self.put_viewed(i, point, point.frame.to_local(-direction));
    }

    /// Stores a surface point and its triangle, viewed along the normal.
    pub(crate) fn put_at_normal(&mut self, i: usize, point: &SurfacePoint) {
        self.triangle[i & 15] = point.triangle;
        self.put_viewed(i, point, Vec3::Z);
    }

    /// Stores a surface point that is viewed from `wo`.
    fn put_viewed(&mut self, i: usize, point: &SurfacePoint, wo: Vec3) {
        let surface = &mut self.surface;
        put(&mut surface.position, i, point.position.to_array());
        surface.error[i & 15] = point.error;
        put(&mut surface.geometric_normal, i, point.geometric_normal.to_array());
        let Frame { tangent, bitangent, normal } = point.frame;
        for (rows, axis) in surface.frame.iter_mut().zip([tangent, bitangent, normal]) {
            put(rows, i, axis.to_array());
        }
        put(&mut surface.wo, i, wo.to_array());
        surface.front = surface.front & !(1 << i) | u32::from(point.front) << i;
        self.attributes[i & 15] = point.attributes;
    }

    /// Surface point of hit `i`.
    #[inline]
    pub(crate) fn point(&self, i: usize) -> SurfacePoint<'a> {
        let i = i & 15;
        let Self { surface, .. } = self;
        let [tangent, bitangent, normal] = &surface.frame;
        SurfacePoint {
            position: at(&surface.position, i).into(),
            error: surface.error[i],
            geometric_normal: at(&surface.geometric_normal, i).into(),
            frame: Frame {
                tangent: at(tangent, i).into(),
                bitangent: at(bitangent, i).into(),
                normal: at(normal, i).into(),
            },
            attributes: self.attributes[i],
            front: self.is_front(i),
            material: self.material[i],
            triangle: self.triangle[i],
        }
    }

    /// True if the viewer of hit `i` is on the front.
    #[inline]
    pub(crate) fn is_front(&self, i: usize) -> bool {
        self.surface.front >> (i & 15) & 1 == 1
    }

    /// Hit `i` of the block.
    #[inline]
    pub(crate) fn at(&self, i: usize) -> Met<'_, 'a> {
        Met { points: self, i: i & 15 }
    }

    /// BSDF at hit `i`.
    #[inline]
    pub(crate) fn bsdf<F: Features>(&self, scene: &Scene, i: usize) -> Bsdf {
        let i = i & 15;
        let texel = (F::TEXTURES && self.textured >> i & 1 == 1).then(|| Rgb::from(at(&self.texel, i)));
        Bsdf::of_texel::<F>((scene, self.material[i]), texel, &self.attributes[i], self.is_front(i))
    }
}

/// Hit of a block.
#[derive(Clone, Copy)]
pub(crate) struct Met<'p, 'a> {
    points: &'p PointBlock<'a>,
    i: usize,
}

impl<'a> Met<'_, 'a> {
    /// Its surface point, if there is one.
    #[inline]
    pub(crate) fn point(&self) -> Option<SurfacePoint<'a>> {
        (self.points.met >> self.i & 1 == 1).then(|| self.points.point(self.i))
    }

    /// BSDF at the point.
    #[inline]
    pub(crate) fn bsdf<F: Features>(&self, scene: &Scene) -> Bsdf {
        self.points.bsdf::<F>(scene, self.i)
    }
}

/// Set of hits of a block.
#[derive(Clone, Copy)]
pub(crate) struct Set(pub(crate) u32);

impl Iterator for Set {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let i = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (i < BLOCK).then_some(i)
    }
}

impl Set {
    /// Hits whose number in `row` has the property `is`.
    #[inline(always)]
    pub(crate) fn of(row: &[u32; BLOCK], is: impl Fn(u32) -> bool) -> u32 {
        let mut set = 0;
        for (i, value) in row.iter().enumerate() {
            set |= u32::from(is(*value)) << i;
        }
        set
    }
}
