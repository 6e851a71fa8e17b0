//! The hierarchy of nodes: placement of meshes, cameras and lights in the world, and poses of skins.

use super::accessor::{Buffers, Rows};
use super::json::{Document, Node, OfInstances};
use super::material::Materials;
use super::{Model, Source, light, mesh};
use crate::load::error::LoadError;
use crate::load::obj::Group;
use crate::load::placed::Placement;
use crate::load::scene::{NamedCamera, View, ViewKind};
use glam::{DMat3, DQuat, DVec3};
use std::collections::HashMap;

/// Bytes of the parts of a placed primitive.
const PART: usize = 512;

/// The scene of a file.
pub(super) fn model(buffers: &Buffers, source: &mut Source) -> Result<Model, LoadError> {
    let nodes = &buffers.document.nodes;
    let world = Hierarchy::new(buffers.document, source);
    let mut builder = Builder {
        buffers,
        world: &world,
        materials: Materials::default(),
        meshes: HashMap::new(),
        model: Model::default(),
    };
    for &number in &world.of_scene {
        let (node, placement) = (&nodes[number], world.placements[number]);
        if let Some(mesh) = node.mesh {
            builder.place(mesh, node, placement, source)?;
        }
        if let Some(light) = &node.extensions.light {
            builder.model.lights.extend(light::light(buffers.document, light.light, &placement, source));
        }
        if let Some(camera) = node.camera {
            builder.model.cameras.extend(camera_at(buffers.document, camera, node, &placement, source));
        }
    }
    let Builder { materials, mut model, .. } = builder;
    (model.materials, model.pictures) = materials.into_parts();
    Ok(model)
}

/// Placements of all nodes, and the nodes of the scene in its order.
struct Hierarchy {
    placements: Vec<Placement>,
    of_scene: Vec<usize>,
}

impl Hierarchy {
    fn new(document: &Document, source: &mut Source) -> Self {
        let nodes = &document.nodes;
        let mut is_child = vec![false; nodes.len()];
        for &child in nodes.iter().flat_map(|node| &node.children) {
            is_child.get_mut(child).into_iter().for_each(|is_child| *is_child = true);
        }
        let free: Vec<usize> = (0..nodes.len()).filter(|&number| !is_child[number]).collect();
        let scene = document.scene.unwrap_or(0);
        let roots = match document.scenes.get(scene) {
            Some(scene) => &scene.nodes,
            None => &free,
        };
        if document.scenes.len() > 1 {
            let count = document.scenes.len();
            source.note(format!("the file has {count} scenes: scene {scene} is read"));
        }
        let mut of_all = Self { placements: vec![Placement::IDENTITY; nodes.len()], of_scene: Vec::new() };
        let mut is_placed = vec![false; nodes.len()];
        let of_scene = of_all.place(nodes, roots, &mut is_placed, source);
        // Joints of skins may lie outside the scene.
        of_all.place(nodes, &free, &mut is_placed, source);
        Self { of_scene, ..of_all }
    }

    /// Places the trees of `roots`; returns their nodes, parents first, each once.
    fn place(
        &mut self,
        nodes: &[Node],
        roots: &[usize],
        is_placed: &mut [bool],
        source: &mut Source,
    ) -> Vec<usize> {
        let mut order = Vec::new();
        let from_roots = |&root: &usize| (root, Placement::IDENTITY, true);
        let mut stack: Vec<(usize, Placement, bool)> = roots.iter().rev().map(from_roots).collect();
        while let Some((number, parent, is_root)) = stack.pop() {
            let Some(node) = nodes.get(number) else {
                source.note("node that does not exist left out");
                continue;
            };
            if core::mem::replace(&mut is_placed[number], true) {
                if !is_root {
                    source.note("node with several parents is placed by the first");
                }
                continue;
            }
            let placement = parent.of(&local(node));
            self.placements[number] = placement;
            order.push(number);
            stack.extend(node.children.iter().rev().map(|&child| (child, placement, false)));
        }
        order
    }
}

/// Transform of a node to its parent.
fn local(node: &Node) -> Placement {
    if let Some(matrix) = &node.matrix {
        return of_matrix(matrix);
    }
    of_parts(node.translation, node.rotation, node.scale)
}

/// Scaled, then rotated by a quaternion x, y, z, w, then translated.
fn of_parts(translation: [f64; 3], rotation: Option<[f64; 4]>, scale: Option<[f64; 3]>) -> Placement {
    let [x, y, z, w] = rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let rotation = DQuat::from_xyzw(x, y, z, w);
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    let scale = DMat3::from_diagonal(scale.unwrap_or([1.0; 3]).into());
    Placement { linear: DMat3::from_quat(rotation) * scale, offset: translation.into() }
}

/// The transform of a matrix in columns.
fn of_matrix(matrix: &[f64; 16]) -> Placement {
    let column = |i: usize| DVec3::new(matrix[4 * i], matrix[4 * i + 1], matrix[4 * i + 2]);
    Placement { linear: DMat3::from_cols(column(0), column(1), column(2)), offset: column(3) }
}

/// A model under construction.
struct Builder<'a> {
    buffers: &'a Buffers<'a>,
    world: &'a Hierarchy,
    materials: Materials,
    /// Index into the meshes of the model by that of the file, and of its skin.
    meshes: HashMap<(usize, Option<usize>), usize>,
    model: Model,
}

impl Builder<'_> {
    /// Adds an instance of a mesh.
    fn place(
        &mut self,
        number: usize,
        node: &Node,
        placement: Placement,
        source: &mut Source,
    ) -> Result<(), LoadError> {
        let skin = node.skin;
        let index = match self.meshes.get(&(number, skin)) {
            Some(&index) => index,
            None => {
                let groups = self.read(number, skin, source)?;
                self.model.meshes.push(groups);
                self.meshes.insert((number, skin), self.model.meshes.len() - 1);
                self.model.meshes.len() - 1
            }
        };
        let bytes = PART * (1 + self.model.meshes[index].len());
        // Joints place a mesh in the world.
        let placement = if skin.is_some() { Placement::IDENTITY } else { placement };
        let of_mesh = self.buffers.document.meshes.get(number).map_or("", |mesh| &mesh.name);
        let name = match (&node.name[..], of_mesh) {
            ("", "") => format!("mesh {number}"),
            ("", name) | (name, _) => name.to_owned(),
        };
        let Some(instancing) = &node.extensions.instancing else {
            source.take(bytes)?;
            self.model.instances.push((name, index, placement));
            return Ok(());
        };
        for inner in self.instances(&instancing.attributes, bytes, source)? {
            self.model.instances.push((name.clone(), index, placement.of(&inner)));
        }
        Ok(())
    }

    /// Placements of the instances of a node (`EXT_mesh_gpu_instancing`), each of which takes `bytes`.
    fn instances(
        &self,
        attributes: &OfInstances,
        bytes: usize,
        source: &mut Source,
    ) -> Result<Vec<Placement>, LoadError> {
        let OfInstances { translation, rotation, scale } = *attributes;
        let translations = translation.map(|number| self.buffers.rows::<3>(number)).transpose()?;
        let rotations = rotation.map(|number| self.buffers.rows::<4>(number)).transpose()?;
        let scales = scale.map(|number| self.buffers.rows::<3>(number)).transpose()?;
        let counts = [
            translations.as_ref().map(|rows| rows.count),
            rotations.as_ref().map(|rows| rows.count),
            scales.as_ref().map(|rows| rows.count),
        ];
        let mut counts = counts.into_iter().flatten();
        let count = counts.next().unwrap_or(0);
        if counts.any(|other| other != count) {
            return Err(self.buffers.error("the attributes of instances differ in their counts"));
        }
        source.take(count.saturating_mul(bytes + size_of::<Placement>()))?;
        let placement = |i| {
            let translation = translations.as_ref().map_or([0.0; 3], |rows| rows.row(i));
            of_parts(
                translation,
                rotations.as_ref().map(|rows| rows.row(i)),
                scales.as_ref().map(|rows| rows.row(i)),
            )
        };
        Ok((0..count).map(placement).collect())
    }

    /// Groups of a mesh.
    fn read(
        &mut self,
        number: usize,
        skin: Option<usize>,
        source: &mut Source,
    ) -> Result<Vec<Group>, LoadError> {
        let missing = || self.buffers.error(format!("there is no mesh {number}"));
        let mesh = self.buffers.document.meshes.get(number).ok_or_else(missing)?;
        let joints = skin.map(|skin| self.joints(skin)).transpose()?;
        if mesh.weights.iter().any(|weight| *weight != 0.0) {
            source.note("morph targets are not supported: left out");
        }
        let mut groups = Vec::new();
        for primitive in &mesh.primitives {
            if primitive.extensions.draco.is_some() && primitive.indices.is_none_or(|at| self.is_empty(at)) {
                return Err(source.encoded("KHR_draco_mesh_compression", "copy"));
            }
            let material = self.materials.number(self.buffers, primitive.material, source)?;
            let texcoords = self.materials.texcoords(material);
            let group = mesh::group(self.buffers, primitive, texcoords, joints.as_deref(), source)?;
            let Some(group) = group else { continue };
            if !group.colors.is_empty() {
                self.materials.color(material, source);
            }
            groups.push(Group { material: Some(material), ..group });
        }
        Ok(groups)
    }

    /// True if an accessor has no bytes.
    fn is_empty(&self, accessor: usize) -> bool {
        self.buffers.document.accessors.get(accessor).is_none_or(|accessor| accessor.buffer_view.is_none())
    }

    /// Transforms of the joints of a skin: to the joint, then with it.
    fn joints(&self, number: usize) -> Result<Vec<Placement>, LoadError> {
        let missing = || self.buffers.error(format!("there is no skin {number}"));
        let skin = self.buffers.document.skins.get(number).ok_or_else(missing)?;
        let inverse: Option<Rows<16>> =
            skin.inverse_bind_matrices.map(|accessor| self.buffers.rows(accessor)).transpose()?;
        let joint = |(i, &joint): (usize, &usize)| {
            let placement = self.world.placements.get(joint).unwrap_or(&Placement::IDENTITY);
            match &inverse {
                Some(inverse) => placement.of(&of_matrix(&inverse.row(i))),
                None => *placement,
            }
        };
        Ok(skin.joints.iter().enumerate().map(joint).collect())
    }
}

/// The camera of a node: along −z of the node, with +y to the top.
fn camera_at(
    document: &Document,
    number: usize,
    node: &Node,
    placement: &Placement,
    source: &mut Source,
) -> Option<NamedCamera> {
    let camera = document.cameras.get(number)?;
    let eye = placement.offset;
    let along = placement.linear * DVec3::NEG_Z;
    let up = placement.linear * DVec3::Y;
    let kind = match (&camera.perspective, &camera.orthographic) {
        (Some(perspective), _) => {
            let fov_degrees = perspective.yfov.to_degrees();
            (fov_degrees > 0.0 && fov_degrees < MOST_FOV).then_some(ViewKind::Perspective { fov_degrees })
        }
        (None, Some(orthographic)) => {
            // `ymag` is half of the height. Exporters write negative ones too.
            let height = 2.0 * orthographic.ymag.abs() * up.length();
            (height > 0.0 && height < MOST_HEIGHT).then_some(ViewKind::Orthographic { height })
        }
        (None, None) => None,
    };
    let is_placed = eye.is_finite() && up.is_finite() && along.try_normalize().is_some();
    let Some(kind) = kind.filter(|_| is_placed) else {
        source.note("camera without a direction, field of view or height left out");
        return None;
    };
    let name = if node.name.is_empty() { camera.name.clone() } else { node.name.clone() };
    let view = View { eye: eye.into(), look_at: (eye + along.normalize()).into(), up: up.into() };
    Some(NamedCamera { name, view, kind })
}

/// Heights of orthographic pictures are smaller.
const MOST_HEIGHT: f64 = 1e30;

/// Vertical fields of view are smaller, in degrees.
const MOST_FOV: f64 = 178.0;
