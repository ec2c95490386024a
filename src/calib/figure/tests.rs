//! Figures are well-formed whatever the data.

use nalgebra::Vector2;

use super::*;
use crate::calib::{image::Plane, observation::Corner, target::BoardSize};

fn all(values: &[f64]) -> Vec<Panel> {
    let bars: Vec<Bar> =
        values.iter().map(|&v| Bar { name: "a<b".into(), mean_px: v, max_px: 2.0 * v }).collect();
    let points: Vec<Vector2<f64>> = values.iter().map(|&v| Vector2::new(100.0 * v, 50.0 * v)).collect();
    let pairs: Vec<Pair> = points.iter().map(|&p| Pair { detected_px: p, projected_px: p }).collect();
    let corners: Vec<Corner> =
        points.iter().enumerate().map(|(i, &px)| Corner { index: i as u32, px, sigma_px: 0.1 }).collect();
    let photo = Plane::new(64, 48);
    let rows = values.len();
    let grid = Grid { columns: 1, rows, values: values.to_vec() };
    vec![
        error_bars(&bars, 0.5, 1.0),
        histogram(values),
        cumulative(values, 0.7),
        error_versus(&[(1.0, 2.0, "3".into())], "t", "x", "y"),
        coverage_points(&points, [64, 48], &[[1.0, 1.0], [60.0, 2.0], [30.0, 40.0]]),
        coverage_density(&points, [64, 48], 10),
        map("t", "px", &grid, [64, 48], Scale::Diverging),
        map("t", "px", &grid, [64, 48], Scale::Logarithmic),
        contact_sheet(&[("one".into(), &photo), ("two".into(), &photo)], 2),
        corner_order(&photo, BoardSize { cols: 3, rows: 3 }, &corners, "t"),
        reprojection(&photo, &pairs, 20.0, "t"),
        before_after(&photo, &photo, "t"),
    ]
}

#[test]
fn every_figure_is_well_formed() {
    let cases: [&[f64]; 5] = [&[], &[0.0], &[0.1, 0.4, 0.2], &[1e-9, 1e9], &[f64::NAN, f64::INFINITY]];
    for values in cases {
        for (i, panel) in all(values).iter().enumerate() {
            let svg = Panel::stacked(&[panel.clone(), Panel::beside(std::slice::from_ref(panel))]).svg();
            let document = roxmltree::Document::parse(&svg).unwrap_or_else(|e| panic!("{i}: {e}\n{svg}"));
            assert_eq!(document.root_element().tag_name().name(), "svg");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{i} {values:?}");
        }
    }
}

#[test]
fn ticks_are_round_and_inside() {
    assert_eq!(axes::ticks([0.0, 1.0], 5), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
    assert_eq!(axes::ticks([30.0, 0.0], 3), [0.0, 10.0, 20.0, 30.0]);
    assert!(axes::ticks([f64::NAN, 1.0], 3).is_empty());
    assert_eq!(axes::label(0.6000000000000001, [0.0, 1.0]), "0.6");
    assert_eq!(axes::label(-20.0, [-30.0, 30.0]), "\u{2212}20");
    assert!((axes::round_up(0.0107) - 0.015).abs() < 1e-12 && axes::round_up(f64::NAN) == 1.0);
}
