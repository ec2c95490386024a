use nalgebra::Vector2;

use super::{SafeRegion, Shown, area, clipped, contains, widest_alpha};
use crate::{
    camera::{Camera, Model},
    uncertainty::Uncertainty,
    undistort::{Framing, View},
};

fn camera(k1: f64, k2: f64) -> Camera {
    Camera::new(Model::Radial2, [640, 480], vec![400.0, 400.0, 319.5, 239.5, k1, k2]).unwrap()
}

/// σ in 20 × 15 cells by the middle of each, px.
fn certainty(sigma: impl Fn(f64, f64) -> f64) -> Uncertainty {
    let middle = |i: usize| (i as f64 + 0.5) * 32.0 - 0.5;
    let grid_px = (0..15).map(|j| (0..20).map(|i| Some(sigma(middle(i), middle(j)))).collect()).collect();
    Uncertainty { range: None, center_px: None, worst_corner_px: None, grid_px }
}

/// Corners over a rectangle, 20 px apart.
fn corners([x0, y0, x1, y1]: [f64; 4]) -> Vec<Vector2<f64>> {
    let along = |a: f64, b: f64| (0..).map(move |i| a + 20.0 * f64::from(i)).take_while(move |v| *v <= b);
    along(y0, y1).flat_map(|y| along(x0, x1).map(move |x| Vector2::new(x, y))).collect()
}

#[test]
fn everything_is_safe_where_all_is_known_and_seen() {
    let region =
        SafeRegion::new(&camera(-0.1, 0.0), &corners([0.0, 0.0, 640.0, 480.0]), &certainty(|_, _| 0.1));
    assert!((region.fraction - 1.0).abs() < 1e-9, "{region:?}");
    assert_eq!(region.polygon_px.len(), 4);
    assert!((region.limit_px, region.far_px) == (0.8, 80.0) && region.words().starts_with("100 %"));
}

#[test]
fn what_is_far_from_corners_is_not_safe() {
    // Corners in the left half only: the border is 80 px to the right of the last.
    let region =
        SafeRegion::new(&camera(-0.1, 0.0), &corners([0.0, 0.0, 300.0, 480.0]), &certainty(|_, _| 0.1));
    let right = region.polygon_px.iter().map(|p| p[0]).fold(0.0, f64::max);
    assert!((right - 380.0).abs() < 1.0 && (region.fraction - 380.5 / 640.0).abs() < 0.01, "{region:?}");
    assert!(contains(&region.polygon_px, &Vector2::new(370.0, 200.0)));
    assert!(!contains(&region.polygon_px, &Vector2::new(390.0, 200.0)));
    assert!(area(&region.polygon_px) > 0.0);
}

#[test]
fn what_is_uncertain_or_beyond_the_fold_is_not_safe() {
    // σ reaches the limit of 0.8 px on a circle of 200 px, and grows by a factor of e each 50 px.
    let off = |x: f64, y: f64| (x - 319.5).hypot(y - 239.5);
    let sigma = certainty(|x, y| 0.8 * ((off(x, y) - 200.0) / 50.0).exp());
    let all = corners([0.0, 0.0, 640.0, 480.0]);
    let region = SafeRegion::new(&camera(-0.1, 0.0), &all, &sigma);
    for [x, y] in &region.polygon_px {
        assert!((off(*x, *y) - 200.0).abs() < 3.0, "{x} {y}");
    }
    // The model turns back 218 px off the middle: r(1 + k1 r²) is largest at r = 1/√(−3 k1).
    let fold = 400.0 * (2.0 / 3.0) * (1.0f64 / (3.0 * 0.5)).sqrt();
    let folded = SafeRegion::new(&camera(-0.5, 0.0), &all, &certainty(|_, _| 0.1));
    assert!(folded.polygon_px.iter().all(|[x, y]| off(*x, *y) < fold + 10.0) && folded.fraction > 0.3);
    // Nothing at all.
    let none = SafeRegion::new(&camera(-0.1, 0.0), &[], &certainty(|_, _| 0.1));
    assert!(none.polygon_px.is_empty() && none.fraction == 0.0);
    assert!(!contains(&none.polygon_px, &Vector2::new(320.0, 240.0)));
    // The larger of two pieces counts.
    let two: Vec<_> =
        corners([0.0, 0.0, 40.0, 40.0]).into_iter().chain(corners([400.0, 200.0, 639.0, 479.0])).collect();
    let region = SafeRegion::new(&camera(-0.1, 0.0), &two, &certainty(|_, _| 0.1));
    assert!(!contains(&region.polygon_px, &Vector2::new(20.0, 20.0)));
    assert!(contains(&region.polygon_px, &Vector2::new(500.0, 400.0)));
}

#[test]
fn a_polygon_is_cut_at_the_border() {
    let square = [[-100.0, 50.0], [300.0, -100.0], [700.0, 50.0], [300.0, 900.0]];
    let cut = clipped(&square, [640, 480]);
    assert!(cut.iter().all(|[x, y]| (-0.5..=639.5).contains(x) && (-0.5..=479.5).contains(y)));
    for (px, inside) in
        [([1.0, 1.0], false), ([300.0, 1.0], true), ([10.0, 470.0], false), ([300.0, 470.0], true)]
    {
        let px = Vector2::from(px);
        assert_eq!((contains(&cut, &px), contains(&square, &px)), (inside, inside), "{px}");
    }
    assert_eq!(clipped(&[[-9.0, -9.0], [-5.0, -9.0], [-5.0, -5.0]], [640, 480]), Vec::<[f64; 2]>::new());
}

#[test]
fn alpha_ends_where_the_safe_region_does() {
    let lens = camera(-0.15, 0.02);
    let shown = |alpha: f64, polygon: &[[f64; 2]]| {
        Shown::new(&lens, &View::new(&lens, &Framing::flat(alpha)).unwrap(), polygon, 48).unsafe_fraction()
    };
    let rectangle = |margin: f64| {
        let [r, b] = [639.5 - margin, 479.5 - margin];
        [[margin - 0.5, margin - 0.5], [r, margin - 0.5], [r, b], [margin - 0.5, b]]
    };
    let widest = |polygon: &[[f64; 2]]| widest_alpha(&lens, &Framing::flat(0.0), polygon).unwrap();
    assert_eq!(widest(&rectangle(0.0)), Some(1.0));
    assert_eq!(widest(&rectangle(60.0)), None);
    // Without the corners of the picture, which only a large α shows.
    let round: Vec<[f64; 2]> = (0..90)
        .map(|i| f64::from(i) / 90.0 * std::f64::consts::TAU)
        .map(|a| [319.5 + 375.0 * a.cos(), 239.5 + 375.0 * a.sin()])
        .collect();
    let alpha = widest(&round).unwrap();
    assert!(alpha > 0.05 && alpha < 0.95, "{alpha}");
    assert!(shown(alpha, &round) < 1e-3 && shown(1.0, &round) > 0.005, "{}", shown(1.0, &round));
}
