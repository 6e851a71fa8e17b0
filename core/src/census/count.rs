//! Census of a scene, counted in one loop over the triangles without allocation.

use crate::geometry::Bounds;
use crate::scene::{ColorInput, Material, PointLight, ScalarInput, Scene, Surface};
use glam::Vec3;

/// Number of triangles of each kind of surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceKinds {
    /// Lambertian.
    pub diffuse: u64,
    /// Perfect mirrors.
    pub mirror: u64,
    /// Thin panes.
    pub pane: u64,
    /// Metals.
    pub conductor: u64,
    /// Coats over a base.
    pub glossy: u64,
    /// Smooth glass.
    pub dielectric: u64,
    /// Rough glass.
    pub rough_dielectric: u64,
}

/// Kind of light from infinity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EnvironmentKind {
    /// Nothing.
    #[default]
    None,
    /// The same radiance from all directions.
    Constant,
    /// A map.
    Map,
}

/// Counts of the triangles, materials and lights of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// All triangles, those of instances included.
    pub triangles: u64,
    /// Triangles in memory: those of a prototype count once. The counts below are of these.
    pub unique_triangles: u64,
    /// Instances.
    pub instances: u64,
    /// Triangles without area, which are never hit.
    pub degenerate: u64,
    /// Materials of the scene, used or not.
    pub materials: u64,
    /// Triangles by kind of surface.
    pub surfaces: SurfaceKinds,
    /// Triangles whose material uses a texture or vertex colours.
    pub textured: u64,
    /// Triangles with a normal or bump map.
    pub normal_mapped: u64,
    /// Triangles with an opacity below one.
    pub cutout: u64,
    /// Triangles of perfectly specular materials, which cast caustics.
    pub specular: u64,
    /// Triangles that emit.
    pub emissive: u64,
    /// Emissive triangles with nothing on the side to which they emit.
    pub emitters_facing_nothing: u64,
    /// Point lights.
    pub point_lights: u64,
    /// Spot lights.
    pub spot_lights: u64,
    /// Directional lights.
    pub directional_lights: u64,
    /// Light from infinity.
    pub environment: EnvironmentKind,
    /// Textures of the scene, used or not.
    pub textures: u64,
    /// True if the camera has a lens.
    pub thin_lens: bool,
}

impl Census {
    /// Census of `scene`.
    pub fn of(scene: &Scene) -> Census {
        let mut census = Census {
            triangles: scene.mesh.triangle_count(),
            unique_triangles: scene.mesh.unique_triangles() as u64,
            instances: scene.mesh.instances.placed.len() as u64,
            materials: scene.materials.len() as u64,
            textures: scene.textures.len() as u64,
            thin_lens: scene.camera.lens_radius > 0.0,
            environment: match &scene.environment {
                None => EnvironmentKind::None,
                Some(environment) if environment.map.is_some() || environment.disc.is_some() => {
                    EnvironmentKind::Map
                }
                Some(_) => EnvironmentKind::Constant,
            },
            ..Census::default()
        };
        for light in scene.lights {
            match light {
                PointLight::Point { .. } => census.point_lights += 1,
                PointLight::Spot { .. } => census.spot_lights += 1,
                PointLight::Directional { .. } => census.directional_lights += 1,
            }
        }
        let bounds = match scene.mesh.instances.is_empty() {
            true => Bounds::around(scene.mesh.positions.iter().map(|&p| p.into())),
            false => scene.mesh.bounds(),
        };
        for (index, triangle) in scene.mesh.triangles.iter().enumerate() {
            if let Some(material) = scene.materials.get(triangle.material as usize) {
                let corners = scene.mesh.corners(index as u32);
                census.count_triangle(material, corners, &bounds, scene.camera.eye);
            }
        }
        let instances = &scene.mesh.instances;
        for prototype in (0..instances.prototypes.len() as u32).map(|number| instances.prototype(number)) {
            for (index, triangle) in prototype.triangles.iter().enumerate() {
                if let Some(material) = scene.materials.get(triangle.material as usize) {
                    let corners = prototype.corners(index as u32);
                    census.count_triangle(material, corners, &bounds, scene.camera.eye);
                }
            }
        }
        census
    }

    fn count_triangle(&mut self, material: &Material, [a, b, c]: [Vec3; 3], bounds: &Bounds, eye: Vec3) {
        let normal = (b - a).cross(c - a);
        self.degenerate += u64::from(normal == Vec3::ZERO);
        self.textured += u64::from(has_texture(material));
        self.normal_mapped += u64::from(material.normal_map.is_some());
        self.cutout += u64::from(material.has_cutout());
        let smooth = |roughness: &ScalarInput| roughness.value == 0.0;
        let mut specular = false;
        let kind = match &material.surface {
            Surface::Diffuse { .. } => &mut self.surfaces.diffuse,
            Surface::Mirror { .. } => {
                specular = true;
                &mut self.surfaces.mirror
            }
            Surface::Pane { .. } => {
                specular = true;
                &mut self.surfaces.pane
            }
            Surface::Conductor { roughness, .. } => {
                specular = smooth(roughness);
                &mut self.surfaces.conductor
            }
            Surface::Glossy { roughness, .. } => {
                specular = smooth(roughness);
                &mut self.surfaces.glossy
            }
            Surface::Dielectric { roughness, .. } => {
                specular = smooth(roughness);
                if specular { &mut self.surfaces.dielectric } else { &mut self.surfaces.rough_dielectric }
            }
        };
        *kind += 1;
        self.specular += u64::from(specular);
        if material.emits() {
            self.emissive += 1;
            // Farthest corner of the scene's bounds in the half-space into which the triangle emits.
            let farthest = Vec3::select(normal.cmpgt(Vec3::ZERO), bounds.max, bounds.min);
            let sees = |p: Vec3| normal.dot(p - a) > FLAT * normal.length() * bounds.diagonal();
            let lonely = !material.two_sided && !sees(farthest) && !sees(eye);
            self.emitters_facing_nothing += u64::from(lonely);
        }
    }

    /// True if the scene has lights of any kind.
    pub fn has_light(&self) -> bool {
        self.emissive + self.point_lights + self.spot_lights + self.directional_lights > 0
            || self.environment != EnvironmentKind::None
    }
}

/// Height above a plane, in diagonals of the scene, within which a point counts as on the plane.
const FLAT: f32 = 1e-5;

fn has_texture(material: &Material) -> bool {
    let color = |input: &ColorInput| input.varies();
    let scalar = |input: &ScalarInput| input.varies();
    let surface = match &material.surface {
        Surface::Diffuse { reflectance } | Surface::Mirror { reflectance } => color(reflectance),
        Surface::Conductor { reflectance, roughness } => color(reflectance) || scalar(roughness),
        Surface::Glossy { base, specular, roughness, metallic, .. } => {
            color(base) || color(specular) || scalar(roughness) || scalar(metallic)
        }
        Surface::Pane { .. } => false,
        Surface::Dielectric { roughness, .. } => scalar(roughness),
    };
    surface || color(&material.emission) || scalar(&material.opacity) || material.normal_map.is_some()
}
