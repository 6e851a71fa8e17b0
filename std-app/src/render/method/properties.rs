//! Methods and their properties: one row each.

use crate::render::Settings;

/// Rendering method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Path tracing with next-event estimation and multiple importance sampling.
    Path,
    /// Indirect light of diffuse surfaces from an irradiance cache.
    IrradianceCache,
    /// Irradiance caching, and light of wide lobes from coefficients of incident radiance.
    RadianceCache,
    /// Photon mapping in two passes, with final gathering.
    PhotonMap,
    /// Stochastic progressive photon mapping.
    ProgressivePhotons,
    /// Path tracing with splats of light subpaths.
    LightTracing,
    /// Bidirectional path tracing.
    Bidirectional,
    /// Vertex connection and merging.
    VertexMerging,
    /// Instant radiosity; paths find the light that its bound cuts.
    InstantRadiosity,
    /// Instant radiosity without the cut light.
    ClampedInstantRadiosity,
    /// Metropolis light transport.
    Metropolis,
    /// Deliberately biased path tracing.
    #[cfg(test)]
    Wrong,
}

/// Properties of a method.
struct Properties {
    method: Method,
    name: &'static str,
    about: &'static str,
    is_biased: bool,
    converges: bool,
    finds_caustics: bool,
    shares: bool,
    /// True if paths without light paths of their own may be joined with caustic photons.
    may_join_caustics: bool,
    /// Settings of the method alone, which determine its picture.
    settings: fn(&Settings) -> String,
}

/// Most common properties.
const UNBIASED: Properties = Properties {
    method: Method::Path,
    name: "",
    about: "",
    is_biased: false,
    converges: true,
    finds_caustics: false,
    shares: true,
    may_join_caustics: false,
    settings: |_| String::new(),
};

/// Rows in the order of [`Method`].
const TABLE: &[Properties] = &[
    Properties {
        method: Method::Path,
        name: "path",
        about: "Path tracing with next-event estimation and multiple importance sampling",
        shares: false,
        may_join_caustics: true,
        ..UNBIASED
    },
    Properties {
        method: Method::IrradianceCache,
        name: "irradiance-cache",
        about: "Path tracing with interpolated indirect light of diffuse surfaces and bases of coats",
        is_biased: true,
        converges: false,
        may_join_caustics: true,
        settings: |settings| format!(", {:?}", settings.cache),
        ..UNBIASED
    },
    Properties {
        method: Method::RadianceCache,
        name: "radiance-cache",
        about: "irradiance-cache with interpolated light of rough metals and rough coats",
        is_biased: true,
        converges: false,
        may_join_caustics: true,
        settings: |settings| format!(", {:?}, {:?}", settings.cache, settings.lobes),
        ..UNBIASED
    },
    Properties {
        method: Method::PhotonMap,
        name: "photon-map",
        about: "Photon mapping: caustics from photons, indirect light by gather rays that end in a map of \
                photons",
        is_biased: true,
        converges: false,
        finds_caustics: true,
        settings: |settings| format!(", {:?}", settings.photons),
        ..UNBIASED
    },
    Properties {
        method: Method::ProgressivePhotons,
        name: "sppm",
        about: "Stochastic progressive photon mapping: reflected light from photons, blurred ever less",
        is_biased: true,
        finds_caustics: true,
        settings: |settings| format!(", {:?}", settings.photons),
        ..UNBIASED
    },
    Properties {
        method: Method::LightTracing,
        name: "light",
        about: "Path tracing, and light paths whose vertices the camera sees",
        settings: |settings| format!(", {:?}", settings.bidirectional),
        ..UNBIASED
    },
    Properties {
        method: Method::Bidirectional,
        name: "bdpt",
        about: "Bidirectional path tracing with a cache of light vertices",
        // It may fall back to paths.
        may_join_caustics: true,
        settings: |settings| format!(", {:?}", settings.bidirectional),
        ..UNBIASED
    },
    Properties {
        method: Method::VertexMerging,
        name: "vcm",
        about: "Vertex connection and merging: bidirectional path tracing, and photons of caustics behind \
                mirrors and glass",
        is_biased: true,
        finds_caustics: true,
        may_join_caustics: true,
        settings: |settings| format!(", {:?}", settings.bidirectional),
        ..UNBIASED
    },
    Properties {
        method: Method::InstantRadiosity,
        name: "instant-radiosity",
        about: "Virtual point lights, and paths for the light that their bound cuts",
        settings: |settings| format!(", {:?}", settings.virtual_lights),
        ..UNBIASED
    },
    Properties {
        method: Method::ClampedInstantRadiosity,
        name: "instant-radiosity-clamped",
        about: "Virtual point lights with a bounded geometry term: dark corners",
        is_biased: true,
        converges: false,
        settings: |settings| format!(", {:?}", settings.virtual_lights),
        ..UNBIASED
    },
    Properties {
        method: Method::Metropolis,
        name: "mlt",
        about: "Metropolis light transport, with path tracing of light that it finds well",
        settings: |settings| format!(", {:?}", settings.metropolis),
        ..UNBIASED
    },
    #[cfg(test)]
    Properties {
        method: Method::Wrong,
        name: "wrong",
        is_biased: true,
        converges: false,
        shares: false,
        ..UNBIASED
    },
];

impl Method {
    /// All methods.
    pub const ALL: [Method; TABLE.len() - cfg!(test) as usize] = {
        let mut all = [Method::Path; TABLE.len() - cfg!(test) as usize];
        let mut row = 0;
        while row < all.len() {
            all[row] = TABLE[row].method;
            assert!(all[row] as usize == row, "rows are in the order of methods");
            row += 1;
        }
        all
    };

    const fn properties(self) -> &'static Properties {
        &TABLE[self as usize]
    }

    /// Name on the command line, in films and in reports.
    pub const fn name(self) -> &'static str {
        self.properties().name
    }

    /// Description in half a line.
    pub const fn about(self) -> &'static str {
        self.properties().about
    }

    /// Method with this name.
    pub fn named(name: &str) -> Option<Method> {
        Method::ALL.into_iter().find(|method| method.name() == name)
    }

    /// True if pictures converge to wrong radiance, or are biased until they converge; their noise does not
    /// reveal that.
    pub const fn is_biased(self) -> bool {
        self.properties().is_biased
    }

    /// True if the error vanishes as samples increase.
    pub const fn converges(self) -> bool {
        self.properties().converges
    }

    /// True if the method finds light that path tracing may miss: caustics of small lamps.
    pub const fn finds_caustics(self) -> bool {
        self.properties().finds_caustics
    }

    /// True if distant pixels share a structure, which correlates their errors: then errors are independent
    /// between even and odd samples, but not between tiles.
    pub const fn shares(self) -> bool {
        self.properties().shares
    }

    /// The part of `settings` that determines a picture of this method and of no other, as text.
    pub(in crate::render) fn own_settings(self, settings: &Settings) -> String {
        (self.properties().settings)(settings)
    }

    /// True if the method has caches of records, which files keep.
    pub const fn has_records(self) -> bool {
        matches!(self, Method::IrradianceCache | Method::RadianceCache)
    }

    /// True if its paths may be joined with caustic photons.
    pub(in crate::render) const fn may_join_caustics(self) -> bool {
        self.properties().may_join_caustics
    }
}
