//! Tests that cross crates, in one program: pictures against known answers and against each other, lights,
//! BSDFs, loading and saving.
//!
//! `cargo test --profile quick -p halflight-tests --test main golden::` runs one module of it.

mod aiming;
mod bidirectional_reference;
mod browser;
mod bsdf;
mod cache_file;
mod cameras;
mod caustics;
mod caustics_cached;
mod choice;
mod counts;
mod environment_visibility;
mod faint_caustics;
mod far;
mod furnace;
mod golden;
mod hall;
mod hidden_light;
mod irradiance_cache;
mod irradiance_gaps;
mod irradiance_rooms;
mod lamp_borders;
mod lamp_cutouts;
mod light_area;
mod light_kinds;
mod light_many;
mod light_support;
mod lightmap_page;
mod load;
mod load_collection;
mod load_meaning;
mod load_names;
mod load_sides;
mod load_support;
mod lobe_rooms;
mod mirrored_caustic;
mod panes;
mod photon_map;
mod picture;
mod radiance_cache;
mod report;
mod reuse;
mod sampling;
mod save;
mod shadow_rays;
mod sppm;
mod stops;
mod table;
mod transport;
mod transport_analytic;
mod view_record_limits;
mod view_records;
