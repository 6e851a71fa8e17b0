//! The JSON of glTF 2.0 (Khronos, ISO/IEC 12113): the objects that a picture needs, with their defaults.

use serde::Deserialize;
use serde::de::IgnoredAny;

/// Declares objects whose keys are optional, in camel case.
macro_rules! objects {
    ($($(#[$doc:meta])* $name:ident { $($(#[$serde:meta])* $field:ident: $kind:ty,)* })*) => { $(
        $(#[$doc])*
        #[derive(Clone, Debug, Default, Deserialize)]
        #[serde(default, rename_all = "camelCase")]
        pub(super) struct $name { $($(#[$serde])* pub(super) $field: $kind,)* }
    )* };
}

objects! {
    /// The whole file.
    Document {
        asset: Asset,
        extensions_used: Vec<String>,
        extensions_required: Vec<String>,
        scene: Option<usize>,
        scenes: Vec<Scene>,
        nodes: Vec<Node>,
        meshes: Vec<Mesh>,
        accessors: Vec<Accessor>,
        buffer_views: Vec<BufferView>,
        buffers: Vec<Buffer>,
        materials: Vec<Material>,
        textures: Vec<Texture>,
        images: Vec<Image>,
        samplers: Vec<Sampler>,
        cameras: Vec<Camera>,
        skins: Vec<Skin>,
        animations: Vec<IgnoredAny>,
        extensions: OfDocument,
    }
    /// The version alone: objects of glTF 1.0 are others.
    Versioned { asset: Asset, }
    Asset { version: String, min_version: Option<String>, generator: String, }
    OfDocument { #[serde(rename = "KHR_lights_punctual")] lights: Lights, }
    Lights { lights: Vec<Light>, }
    Scene { nodes: Vec<usize>, }
    /// A transform is a matrix in columns, or translation, rotation (a quaternion x, y, z, w) and scale.
    Node {
        name: String,
        children: Vec<usize>,
        matrix: Option<Box<[f64; 16]>>,
        translation: [f64; 3],
        rotation: Option<[f64; 4]>,
        scale: Option<[f64; 3]>,
        mesh: Option<usize>,
        camera: Option<usize>,
        skin: Option<usize>,
        extensions: OfNode,
    }
    OfNode {
        #[serde(rename = "KHR_lights_punctual")] light: Option<LightOfNode>,
        #[serde(rename = "EXT_mesh_gpu_instancing")] instancing: Option<Box<Instancing>>,
    }
    Instancing { attributes: OfInstances, }
    OfInstances {
        #[serde(rename = "TRANSLATION")] translation: Option<usize>,
        #[serde(rename = "ROTATION")] rotation: Option<usize>,
        #[serde(rename = "SCALE")] scale: Option<usize>,
    }
    LightOfNode { light: usize, }
    Mesh { name: String, primitives: Vec<Primitive>, weights: Vec<f64>, }
    Primitive {
        attributes: Attributes,
        indices: Option<usize>,
        material: Option<usize>,
        mode: Option<u32>,
        extensions: OfPrimitive,
    }
    Attributes {
        #[serde(rename = "POSITION")] position: Option<usize>,
        #[serde(rename = "NORMAL")] normal: Option<usize>,
        #[serde(rename = "TEXCOORD_0")] texcoord_0: Option<usize>,
        #[serde(rename = "TEXCOORD_1")] texcoord_1: Option<usize>,
        #[serde(rename = "TEXCOORD_2")] texcoord_2: Option<usize>,
        #[serde(rename = "TEXCOORD_3")] texcoord_3: Option<usize>,
        #[serde(rename = "COLOR_0")] color_0: Option<usize>,
        #[serde(rename = "JOINTS_0")] joints_0: Option<usize>,
        #[serde(rename = "JOINTS_1")] joints_1: Option<usize>,
        #[serde(rename = "WEIGHTS_0")] weights_0: Option<usize>,
    }
    OfPrimitive { #[serde(rename = "KHR_draco_mesh_compression")] draco: Option<IgnoredAny>, }
    Accessor {
        buffer_view: Option<usize>,
        byte_offset: u64,
        component_type: u32,
        normalized: bool,
        count: u64,
        #[serde(rename = "type")] kind: String,
        sparse: Option<Box<Sparse>>,
    }
    Sparse { count: u64, indices: SparsePart, values: SparsePart, }
    SparsePart { buffer_view: usize, byte_offset: u64, component_type: u32, }
    BufferView { buffer: usize, byte_offset: u64, byte_length: u64, byte_stride: Option<u64>, }
    Buffer { uri: Option<String>, byte_length: u64, }
    Skin { inverse_bind_matrices: Option<usize>, joints: Vec<usize>, }
    Camera { name: String, perspective: Option<Perspective>, orthographic: Option<Orthographic>, }
    Perspective { yfov: f64, }
    Orthographic { ymag: f64, }
    Light {
        #[serde(rename = "type")] kind: String,
        color: Option<[f64; 3]>,
        intensity: Option<f64>,
        spot: Spot,
    }
    Spot { inner_cone_angle: f64, outer_cone_angle: Option<f64>, }
    Texture { source: Option<usize>, sampler: Option<usize>, extensions: OfTexture, }
    OfTexture {
        #[serde(rename = "EXT_texture_webp")] webp: Option<Source>,
        #[serde(rename = "KHR_texture_basisu")] basisu: Option<IgnoredAny>,
    }
    Source { source: usize, }
    Image { name: String, uri: Option<String>, buffer_view: Option<usize>, }
    Sampler { wrap_s: Option<u32>, wrap_t: Option<u32>, }
    Material {
        name: String,
        pbr_metallic_roughness: MetallicRoughness,
        normal_texture: Option<TextureInfo>,
        emissive_texture: Option<TextureInfo>,
        emissive_factor: [f64; 3],
        alpha_mode: Option<String>,
        alpha_cutoff: Option<f64>,
        double_sided: bool,
        extensions: OfMaterial,
    }
    MetallicRoughness {
        base_color_factor: Option<[f64; 4]>,
        base_color_texture: Option<TextureInfo>,
        metallic_factor: Option<f64>,
        roughness_factor: Option<f64>,
        metallic_roughness_texture: Option<TextureInfo>,
    }
    TextureInfo {
        index: usize,
        tex_coord: u32,
        scale: Option<f64>,
        extensions: OfTextureInfo,
    }
    OfTextureInfo { #[serde(rename = "KHR_texture_transform")] transform: Option<Box<TextureTransform>>, }
    TextureTransform {
        offset: [f64; 2],
        rotation: f64,
        scale: Option<[f64; 2]>,
        tex_coord: Option<u32>,
    }
    OfMaterial {
        #[serde(rename = "KHR_materials_emissive_strength")] emissive: Option<EmissiveStrength>,
        #[serde(rename = "KHR_materials_ior")] ior: Option<Ior>,
        #[serde(rename = "KHR_materials_specular")] specular: Option<Box<Specular>>,
        #[serde(rename = "KHR_materials_clearcoat")] clearcoat: Option<Box<Clearcoat>>,
        #[serde(rename = "KHR_materials_transmission")] transmission: Option<Box<Transmission>>,
        #[serde(rename = "KHR_materials_volume")] volume: Option<Box<Volume>>,
        #[serde(rename = "KHR_materials_unlit")] unlit: Option<IgnoredAny>,
    }
    EmissiveStrength { emissive_strength: Option<f64>, }
    Ior { ior: Option<f64>, }
    Specular {
        specular_factor: Option<f64>,
        specular_texture: Option<TextureInfo>,
        specular_color_factor: Option<[f64; 3]>,
        specular_color_texture: Option<TextureInfo>,
    }
    Clearcoat {
        clearcoat_factor: f64,
        clearcoat_texture: Option<TextureInfo>,
        clearcoat_roughness_factor: f64,
        clearcoat_roughness_texture: Option<TextureInfo>,
        clearcoat_normal_texture: Option<IgnoredAny>,
    }
    Transmission { transmission_factor: f64, transmission_texture: Option<TextureInfo>, }
    Volume {
        thickness_factor: f64,
        attenuation_distance: Option<f64>,
        attenuation_color: Option<[f64; 3]>,
    }
}

/// Extensions that are read, or that change nothing in a picture.
pub(super) const READ: [&str; 15] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_clearcoat",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "KHR_node_visibility",
];

/// Extensions that encode data, and the command of `@gltf-transform/cli` that decodes it.
pub(super) const ENCODED: [(&str, &str); 4] = [
    ("KHR_draco_mesh_compression", "copy"),
    ("EXT_meshopt_compression", "copy"),
    ("KHR_meshopt_compression", "copy"),
    ("KHR_texture_basisu", "ktxdecompress"),
];
