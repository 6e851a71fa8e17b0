//! Derivatives of irradiance alone: gradient and Hessian from the radiances and distances that gather rays of
//! a point have found (Schwarzhaupt, Jensen, Jarosz 2012, occlusion-aware), and the eigen decomposition that
//! bounds a record.
use halflight_core::Level;
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::parts::eigen::symmetric2;
use halflight_core::parts::irradiance::{CellFlux, Hemisphere, Metric, cosine_hemisphere, metric, validity};

/// Strata along a side of the hemisphere.
const N: usize = 16;

fn main() -> Result<(), OutOfMemory> {
    // A floor under a ceiling 3 m above: bright beyond an edge towards +x, dark elsewhere.
    let (mut radiance, mut inverse_distance) = ([[0.0; 3]; N * N], [0.0; N * N]);
    let mut directions = [[0.0; 3]; N * N];
    for i in 0..N * N {
        let middle = |cell: usize| (cell as f32 + 0.5) / N as f32;
        let direction = cosine_hemisphere([middle(i % N), middle(i / N)]);
        radiance[i] = if direction.x > 0.3 { [1.0; 3] } else { [0.1; 3] };
        inverse_distance[i] = direction.z / 3.0;
        directions[i] = direction.to_array();
    }
    let hemisphere = Hemisphere::new(N, &radiance, &inverse_distance, &directions).expect("N * N strata");

    let mut memory = [Line([0; 64]); 1024];
    assert!(CellFlux::footprint(N).bytes() <= size_of_val(&memory));
    let tables = CellFlux::build(N, &mut Arena::over(&mut memory))?;
    let derivatives = tables.derivatives(Level::detect(), &hemisphere).expect("tables of N strata");
    println!("irradiance {:.3} W/m²", derivatives.luminance());
    println!("gradient {:.4} W/m³", derivatives.luminance_gradient());

    let hessian = derivatives.hessian;
    let eigen = symmetric2(|value| value, [hessian.xx, hessian.xy, hessian.yy]);
    println!("curvatures {:?} W/m⁴, the larger along {:?}", eigen.values, eigen.axis);

    // The region in which the record may be used, for an error of 1e-4 in a scene of 10 m.
    let region = validity(&metric::Settings::new(Metric::Halflight, 10.0), &derivatives);
    println!("{region:?}");
    Ok(())
}
