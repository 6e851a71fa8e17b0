//! Kinds of methods and their properties: one row each.

/// Kind of a method, without its options.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodKind {
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
}

/// Properties of a kind.
struct Properties {
    kind: MethodKind,
    name: &'static str,
    about: &'static str,
    is_biased: bool,
    converges: bool,
    finds_caustics: bool,
    shares: bool,
    /// True if records or photons serve many samples.
    has_common_errors: bool,
    /// True if paths without light paths of their own may be joined with caustic photons.
    may_join_caustics: bool,
}

/// Most common properties.
const UNBIASED: Properties = Properties {
    kind: MethodKind::Path,
    name: "",
    about: "",
    is_biased: false,
    converges: true,
    finds_caustics: false,
    shares: true,
    has_common_errors: false,
    may_join_caustics: false,
};

/// Rows in the order of [`MethodKind`].
const TABLE: &[Properties] = &[
    Properties {
        kind: MethodKind::Path,
        name: "path",
        about: "Path tracing with next-event estimation and multiple importance sampling",
        shares: false,
        may_join_caustics: true,
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::IrradianceCache,
        name: "irradiance-cache",
        about: "Path tracing with interpolated indirect light of diffuse surfaces and bases of coats",
        is_biased: true,
        converges: false,
        may_join_caustics: true,
        has_common_errors: true,
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::RadianceCache,
        name: "radiance-cache",
        about: "irradiance-cache with interpolated light of rough metals and rough coats",
        is_biased: true,
        converges: false,
        may_join_caustics: true,
        has_common_errors: true,
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::PhotonMap,
        name: "photon-map",
        about: "Photon mapping: caustics from photons, indirect light by gather rays that end in a map of \
                photons",
        is_biased: true,
        converges: false,
        finds_caustics: true,
        has_common_errors: true,
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::ProgressivePhotons,
        name: "sppm",
        about: "Stochastic progressive photon mapping: reflected light from photons, blurred ever less",
        is_biased: true,
        finds_caustics: true,
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::LightTracing,
        name: "light",
        about: "Path tracing, and light paths whose vertices the camera sees",
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::Bidirectional,
        name: "bdpt",
        about: "Bidirectional path tracing with a cache of light vertices",
        // It may fall back to paths.
        may_join_caustics: true,
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::VertexMerging,
        name: "vcm",
        about: "Vertex connection and merging: bidirectional path tracing, and photons of caustics behind \
                mirrors and glass",
        is_biased: true,
        finds_caustics: true,
        may_join_caustics: true,
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::InstantRadiosity,
        name: "instant-radiosity",
        about: "Virtual point lights, and paths for the light that their bound cuts",
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::ClampedInstantRadiosity,
        name: "instant-radiosity-clamped",
        about: "Virtual point lights with a bounded geometry term: dark corners",
        is_biased: true,
        converges: false,
        ..UNBIASED
    },
    Properties {
        kind: MethodKind::Metropolis,
        name: "mlt",
        about: "Metropolis light transport, with path tracing of light that it finds well",
        ..UNBIASED
    },
];

impl MethodKind {
    /// All kinds.
    pub const ALL: [MethodKind; TABLE.len()] = {
        let mut all = [MethodKind::Path; TABLE.len()];
        let mut row = 0;
        while row < all.len() {
            all[row] = TABLE[row].kind;
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

    /// Kind with this name.
    pub fn named(name: &str) -> Option<MethodKind> {
        MethodKind::ALL.into_iter().find(|kind| kind.name() == name)
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

    /// True if records or photons serve several samples: then neighbouring pixels have errors in common, and
    /// judge each other too well in a reconstruction.
    pub const fn has_common_errors(self) -> bool {
        self.properties().has_common_errors
    }

    /// True if the method has caches of records, which files keep.
    pub const fn has_records(self) -> bool {
        matches!(self, MethodKind::IrradianceCache | MethodKind::RadianceCache)
    }

    /// True if its paths may be joined with caustic photons.
    pub const fn may_join_caustics(self) -> bool {
        self.properties().may_join_caustics
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_the_order_of_kinds() {
        assert!(TABLE.iter().enumerate().all(|(row, properties)| properties.kind as usize == row));
        assert!(MethodKind::ALL.into_iter().all(|kind| MethodKind::named(kind.name()) == Some(kind)));
    }
}
