//! Features of the shading code as constants: branches for features that the census excludes are removed at
//! compile time.

/// Kinds of shading that a build of a method supports. Code of the others is not compiled.
pub trait Features: Copy + Send + Sync + 'static {
    /// Colours and numbers may come from textures.
    const TEXTURES: bool;
    /// Surfaces that reflect other than diffusely: mirror, conductor, glossy, plastic.
    const GLOSSY: bool;
    /// Surfaces that transmit: smooth and rough dielectrics.
    const DIELECTRIC: bool;
    /// Normal and bump maps.
    const NORMAL_MAPS: bool;
    /// Opacity below one.
    const CUTOUT: bool;
}

/// Set of exactly the features whose parameter is `true`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Only<
    const TEXTURES: bool,
    const GLOSSY: bool,
    const DIELECTRIC: bool,
    const NORMAL_MAPS: bool,
    const CUTOUT: bool,
>;

impl<
    const TEXTURES: bool,
    const GLOSSY: bool,
    const DIELECTRIC: bool,
    const NORMAL_MAPS: bool,
    const CUTOUT: bool,
> Features for Only<TEXTURES, GLOSSY, DIELECTRIC, NORMAL_MAPS, CUTOUT>
{
    const TEXTURES: bool = TEXTURES;
    const GLOSSY: bool = GLOSSY;
    const DIELECTRIC: bool = DIELECTRIC;
    const NORMAL_MAPS: bool = NORMAL_MAPS;
    const CUTOUT: bool = CUTOUT;
}

/// All features: correct for any scene.
pub type All = Only<true, true, true, true, true>;
/// Diffuse surfaces of uniform colour.
pub type DiffuseOnly = Only<false, false, false, false, false>;
/// Diffuse surfaces with textures.
pub type DiffuseTextured = Only<true, false, false, false, false>;
/// Opaque surfaces with every kind of texture: no glass.
pub type Opaque = Only<true, true, false, true, true>;
