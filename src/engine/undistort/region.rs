//! The part of the plane of a projection that the photograph shows: its border, traced in stored pixels and unprojected.

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};

use super::{Projection, reach};
use crate::{Error, Result, lens::Lens, order};

/// Most border points on one side of the photograph. On a side of 1280 px that bows by 30 px, chords between 400 points leave
/// the arc by less than 0.001 px.
const POINTS_PER_SIDE: u32 = 400;

/// A closed polygon in the plane around what the photograph shows.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// Corners in the order of the border; the last joins the first.
    pub(super) border: Vec<Vector2<f64>>,
    /// A point inside: what the middle of the picture, or the nearest pixel to it that has a ray, shows.
    pub(super) inside: Vector2<f64>,
    /// Largest angle off the axis that may be shown, rad.
    pub(super) limit_rad: f64,
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Its place in the plane.
    point: Vector2<f64>,
    /// Its angle off the axis, rad.
    angle_rad: f64,
}

/// Traces the border.
///
/// Where border pixels have no usable ray (the model folds before it reaches them, or they look too far off the axis), the
/// circle of the largest usable angle takes their place.
pub(super) fn trace(camera: &dyn Lens, projection: Projection) -> Result<Region> {
    let spec = projection.spec();
    let pixels = border_pixels(camera.size_px());
    let rays: Vec<_> = pixels.iter().map(|px| seen(camera, projection, px)).collect();
    let view = rays.iter().flatten().map(|s| s.angle_rad).fold(0.0, f64::max);
    let all = rays.iter().all(Option::is_some);
    let fold = if all { reach::fold_within(camera, view) } else { camera.fold_rad() };
    let limit_rad = fold.min(spec.max_angle_rad);
    let usable = |s: Option<Seen>| s.filter(|s| s.angle_rad <= limit_rad).map(|s| s.point);
    let inside = anchor(camera, |px| usable(seen(camera, projection, px)))?;
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px().map(|n| f64::from(n) - 1.0);
    let shown = |ray: &Vector3<f64>| {
        let px = camera.project_px(ray);
        px.is_some_and(|px| px.x >= 0.0 && px.y >= 0.0 && px.x <= w && px.y <= h)
    };
    let (sin, cos) = limit_rad.sin_cos();
    let mut border = Vec::with_capacity(pixels.len());
    for (i, px) in pixels.iter().enumerate() {
        let here = usable(rays[i]);
        match here {
            Some(p) => border.push(p),
            None => {
                let towards = Vector2::new((px.x - cx) / fx, (px.y - cy) / fy);
                let ray = towards.try_normalize(0.0).map(|d| (d * sin).push(cos)).filter(shown);
                border.extend(ray.and_then(|ray| point(projection, &ray)));
            }
        }
        // Where the border leaves what has rays, or comes back, the corner is found exactly.
        let next = (i + 1) % pixels.len();
        if here.is_some() != usable(rays[next]).is_some() {
            let (mut good, mut bad) = if here.is_some() { (*px, pixels[next]) } else { (pixels[next], *px) };
            let mut corner = None;
            for _ in 0..40 {
                let middle = (good + bad) * 0.5;
                match usable(seen(camera, projection, &middle)) {
                    Some(p) => (good, corner) = (middle, Some(p)),
                    None => bad = middle,
                }
            }
            border.extend(corner);
        }
    }
    Ok(Region { border: over_the_poles(border, spec.max_y), inside, limit_rad })
}

/// On a cylinder the border of a view that holds a pole ends at one side and goes on at the other: between them lies all that is above,
/// or below.
fn over_the_poles(border: Vec<Vector2<f64>>, max_y: f64) -> Vec<Vector2<f64>> {
    if !max_y.is_finite() {
        return border;
    }
    let mut whole = Vec::with_capacity(border.len() + 4);
    for (i, a) in border.iter().enumerate() {
        whole.push(*a);
        let b = border[(i + 1) % border.len()];
        if (b.x - a.x).abs() > PI {
            let edge = |x: f64| Vector2::new(PI.copysign(x), max_y.copysign(a.y));
            whole.extend([edge(a.x), edge(b.x)]);
        }
    }
    whole
}

/// What a pixel shows; `None` where it has no ray, or none that the projection has.
fn seen(camera: &dyn Lens, projection: Projection, px: &Vector2<f64>) -> Option<Seen> {
    let ray = camera.unproject(px)?;
    Some(Seen { point: point(projection, &ray)?, angle_rad: ray.x.hypot(ray.y).atan2(ray.z) })
}

/// The place of a ray in the plane, moved to the edge of what is shown where it lies above or below.
fn point(projection: Projection, ray: &Vector3<f64>) -> Option<Vector2<f64>> {
    let spec = projection.spec();
    let point = (spec.point)(ray)?;
    Some(Vector2::new(point.x, point.y.clamp(-spec.max_y, spec.max_y)))
}

/// What a pixel that has a ray shows: the middle of the picture where possible, else the nearest to it on a grid.
fn anchor(camera: &dyn Lens, usable: impl Fn(&Vector2<f64>) -> Option<Vector2<f64>>) -> Result<Vector2<f64>> {
    const GRID: u32 = 32;
    let [w, h] = camera.size_px().map(|n| f64::from(n) - 1.0);
    let middle = Vector2::new(0.5 * w, 0.5 * h);
    if let Some(point) = usable(&middle) {
        return Ok(point);
    }
    let mut pixels: Vec<Vector2<f64>> = (0..=GRID)
        .flat_map(|j| (0..=GRID).map(move |i| [i, j].map(|k| f64::from(k) / f64::from(GRID))))
        .map(|[a, b]| Vector2::new(a * w, b * h))
        .collect();
    order::by(&mut pixels, |p| [(p - middle).norm()]);
    pixels.iter().find_map(usable).ok_or_else(|| {
        Error::Degenerate(
            "no pixel of the photograph can be undistorted with this camera: check its size, focal length and distortion"
                .to_owned(),
        )
    })
}

/// Pixels along the border, clockwise from the top left corner.
fn border_pixels(size: [u32; 2]) -> Vec<Vector2<f64>> {
    let [w, h] = size.map(|n| f64::from(n) - 1.0);
    let [nx, ny] = size.map(|n| (n - 1).clamp(1, POINTS_PER_SIDE));
    let along = |i: u32, n: u32, last: f64| last * f64::from(i) / f64::from(n);
    let mut border = Vec::new();
    border.extend((0..nx).map(|i| Vector2::new(along(i, nx, w), 0.0)));
    border.extend((0..ny).map(|i| Vector2::new(w, along(i, ny, h))));
    border.extend((0..nx).map(|i| Vector2::new(w - along(i, nx, w), h)));
    border.extend((0..ny).map(|i| Vector2::new(0.0, h - along(i, ny, h))));
    border
}
