//! Embree 3: its high-quality BVH on one thread, with every entry point for single rays and packets of 8 and
//! 16, coherent and incoherent.

use super::classes::Class;
use super::measure::{Entry, Rival};
use super::packets;
use crate::Result;
use embree3::{
    BufferUsage, BuildQuality, Config, Device, DeviceProperty, Format, GeometryKind, Ray as SingleRay, Ray8,
    Ray16, RayHit, RayHit8, RayHit16, Scene,
};
use halflight_core::scene::Mesh;

pub(super) struct Embree {
    device: Device,
    scene: Scene<'static>,
}

impl Embree {
    pub(super) fn new() -> Result<Self> {
        let device = Device::with_config(Config { threads: 1, ..Config::default() }).map_err(refused)?;
        let scene = device.create_scene().map_err(refused)?;
        Ok(Self { device, scene })
    }
}

fn refused(error: embree3::Error) -> String {
    format!("Embree refuses: {error:?}")
}

impl Rival for Embree {
    fn name(&self) -> String {
        let part = |property| self.device.get_property(property).unwrap_or(0);
        let version =
            [DeviceProperty::VERSION_MAJOR, DeviceProperty::VERSION_MINOR, DeviceProperty::VERSION_PATCH];
        let [major, minor, patch] = version.map(part);
        format!("Embree {major}.{minor}.{patch}")
    }

    fn build(&mut self, mesh: &Mesh) -> Result<()> {
        let mut scene = self.device.create_scene().map_err(refused)?;
        scene.set_build_quality(BuildQuality::HIGH);
        let mut geometry = self.device.create_geometry(GeometryKind::TRIANGLE).map_err(refused)?;
        geometry
            .set_new_buffer::<[f32; 3]>(BufferUsage::VERTEX, 0, Format::FLOAT3, 12, mesh.positions.len())
            .map_err(refused)?
            .copy_from_slice(mesh.positions);
        let mut indices = geometry
            .set_new_buffer::<[u32; 3]>(BufferUsage::INDEX, 0, Format::UINT3, 12, mesh.triangles.len())
            .map_err(refused)?;
        for (index, triangle) in indices.iter_mut().zip(mesh.triangles) {
            *index = triangle.vertices;
        }
        scene.attach_geometry(&geometry.commit());
        scene.commit();
        self.scene = scene;
        Ok(())
    }

    fn entries(&self, class: Class) -> Vec<Box<dyn Entry + '_>> {
        let scene = &self.scene;
        let entries = match class {
            Class::Primary | Class::Diffuse => [
                packets::both::<RayHit>(scene),
                packets::both::<RayHit8>(scene),
                packets::both::<RayHit16>(scene),
            ],
            Class::Shadow => [
                packets::both::<SingleRay>(scene),
                packets::both::<Ray8>(scene),
                packets::both::<Ray16>(scene),
            ],
        };
        entries.into_iter().flatten().collect()
    }
}
