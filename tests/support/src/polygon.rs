//! Convex polygons as seen from the origin, and their irradiance by Lambert's formula.

use glam::DVec3;

/// Edges of a polygon.
pub fn edges(polygon: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> {
    polygon.iter().copied().zip(polygon.iter().copied().cycle().skip(1))
}

/// Part of a polygon above a plane through the origin with the normal `plane` (Sutherland, Hodgman).
pub fn above(polygon: &[DVec3], plane: DVec3) -> Vec<DVec3> {
    let mut clipped = Vec::new();
    for (p, q) in edges(polygon) {
        let (s, t) = (p.dot(plane), q.dot(plane));
        if s >= 0.0 {
            clipped.push(p);
        }
        if (s < 0.0) != (t < 0.0) {
            clipped.push(p.lerp(q, s / (s - t)));
        }
    }
    clipped
}

/// Part of a polygon behind `window`, which is counter-clockwise as seen from the origin.
pub fn behind(polygon: &[DVec3], window: &[DVec3]) -> Vec<DVec3> {
    edges(window).fold(polygon.to_vec(), |polygon, (a, b)| above(&polygon, a.cross(b)))
}

/// True if the ray from the origin along `w` meets a polygon that is counter-clockwise as seen from there,
/// and its distance.
pub fn distance(polygon: &[DVec3], w: DVec3) -> Option<f64> {
    if edges(polygon).any(|(a, b)| w.dot(a.cross(b)) < 0.0) {
        return None;
    }
    let normal = normal(polygon);
    Some(normal.dot(polygon[0]) / normal.dot(w)).filter(|t| *t > 0.0)
}

/// Unit normal of a polygon of at least three corners; away from the origin if it is counter-clockwise as
/// seen from there.
pub fn normal(polygon: &[DVec3]) -> DVec3 {
    (polygon[1] - polygon[0]).cross(polygon[2] - polygon[0]).normalize()
}

/// Irradiance at the origin, with the unit normal `n`, from a polygon of radiance 1 above its plane that is
/// counter-clockwise as seen from there (Lambert).
pub fn irradiance(polygon: &[DVec3], n: DVec3) -> f64 {
    let of_edge = |(a, b): (DVec3, DVec3)| {
        let normal = a.cross(b);
        let sin = normal.length();
        if sin == 0.0 { 0.0 } else { 0.5 * sin.atan2(a.dot(b)) * n.dot(normal) / sin }
    };
    edges(polygon).map(of_edge).sum()
}
