//! Figure 4: reprojection errors per picture, their histogram and their distribution.

use super::{
    axes::{Axes, Names, round_up},
    color,
    svg::{Anchor, Panel, Type},
};

/// Errors above this are worth a look in most calibrations: the line in the figure, px.
pub const THRESHOLD_PX: f64 = 1.0;

/// Errors of one picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// Below the bar: number or name of the picture.
    pub name: String,
    /// Height of the bar, px.
    pub mean_px: f64,
    /// End of the whisker, px: the worst corner.
    pub max_px: f64,
}

/// Mean error of each picture with a whisker to its worst corner, the overall RMS and a threshold, px. A threshold
/// far above all errors is named instead of drawn, so that the bars stay readable.
pub fn error_bars(bars: &[Bar], overall_rms_px: f64, threshold_px: f64) -> Panel {
    let tallest = bars.iter().map(|b| b.max_px).fold(overall_rms_px, f64::max);
    let near = threshold_px < 4.0 * tallest;
    let top = round_up(1.05 * if near { tallest.max(threshold_px) } else { tallest });
    let x_name = if near {
        "Picture".to_owned()
    } else {
        format!("Picture (threshold {threshold_px:.1} px is above the plot)")
    };
    let n = bars.len().max(1) as f64;
    let names = Names { title: "Error per picture", x: &x_name, y: "Mean error, px", x_ticks: false };
    let (mut p, axes) = Axes::draw(440.0, 300.0, [0.5, n + 0.5], [0.0, top], names);
    let slot = axes.area[2] / n;
    let every = (bars.len() as f64 * 22.0 / axes.area[2]).ceil().max(1.0) as usize;
    for (i, bar) in bars.iter().enumerate() {
        let [x, y] = axes.at(i as f64 + 1.0, bar.mean_px);
        let floor = axes.at(0.0, 0.0)[1];
        p.rect(x - 0.35 * slot, y, 0.7 * slot, floor - y, color::BLUE, "");
        let high = axes.at(0.0, bar.max_px)[1];
        p.line([x, y], [x, high], color::MUTED, 1.0, "");
        p.line([x - 0.15 * slot, high], [x + 0.15 * slot, high], color::MUTED, 1.0, "");
        if i % every == 0 {
            p.text([x, floor + 16.0], &bar.name, Type::TICK);
        }
    }
    axes.level(&mut p, overall_rms_px, &format!("overall RMS {overall_rms_px:.4} px"), color::GREEN);
    if near {
        axes.level(&mut p, threshold_px, &format!("threshold {threshold_px:.1} px"), color::ORANGE);
    }
    p
}

/// Histogram of errors, px.
pub fn histogram(errors_px: &[f64]) -> Panel {
    const BINS: usize = 30;
    let errors_px: Vec<f64> = errors_px.iter().copied().filter(|e| e.is_finite()).collect();
    let end = round_up(errors_px.iter().copied().fold(0.0, f64::max));
    let mut counts = [0usize; BINS];
    for e in &errors_px {
        counts[((e / end * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    let top = round_up(1.05 * counts.iter().copied().max().unwrap_or(0) as f64);
    let title = format!("Histogram of {} errors", errors_px.len());
    let names = Names { title: &title, x: "Error, px", y: "Corners", x_ticks: true };
    let (mut p, axes) = Axes::draw(400.0, 300.0, [0.0, end], [0.0, top], names);
    for (i, &count) in counts.iter().enumerate() {
        let at = |k: usize| k as f64 / BINS as f64 * end;
        let [x0, y] = axes.at(at(i), count as f64);
        let [x1, floor] = axes.at(at(i + 1), 0.0);
        p.rect(x0 + 0.5, y, x1 - x0 - 1.0, floor - y, color::BLUE, "");
    }
    let mean = errors_px.iter().sum::<f64>() / errors_px.len().max(1) as f64;
    axes.mark(&mut p, mean, &format!("mean {mean:.4} px"), color::GREEN);
    p
}

/// Cumulative distribution of errors with the 95th percentile, px.
pub fn cumulative(errors_px: &[f64], p95_px: f64) -> Panel {
    let mut sorted: Vec<f64> = errors_px.iter().copied().filter(|e| e.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let end = round_up(sorted.last().copied().unwrap_or(0.0));
    let names =
        Names { title: "Cumulative distribution", x: "Error, px", y: "Share of corners, %", x_ticks: true };
    let (mut p, axes) = Axes::draw(400.0, 300.0, [0.0, end], [0.0, 100.0], names);
    let n = sorted.len().max(1) as f64;
    let mut points = vec![axes.at(0.0, 0.0)];
    points.extend(sorted.iter().enumerate().map(|(i, &e)| axes.at(e, 100.0 * (i + 1) as f64 / n)));
    p.path(&points, color::BLUE, 2.0);
    let [x, y] = axes.at(p95_px, 95.0);
    let [left, floor] = axes.at(0.0, 0.0);
    let dashes = "stroke-dasharray=\"6 4\"";
    p.line([x, floor], [x, y], color::ORANGE, 1.5, dashes);
    p.line([left, y], [x, y], color::ORANGE, 1.5, dashes);
    p.circle([x, y], 4.0, &format!("fill=\"{}\"", color::ORANGE));
    let name = format!("95 % below {p95_px:.4} px");
    // Beside the point, where the curve is not.
    let (dx, anchor) =
        if x < 0.5 * (left + axes.at(end, 0.0)[0]) { (8.0, Anchor::Start) } else { (-8.0, Anchor::End) };
    p.text_over([x + dx, y + 16.0], &name, Type::TICK.colored(color::ORANGE).anchored(anchor));
    p
}

/// Points of a quantity against another, with names of the axes: error against tilt, for one.
pub fn error_versus(points: &[(f64, f64, String)], title: &str, x_name: &str, y_name: &str) -> Panel {
    let end = |f: fn(&(f64, f64, String)) -> f64| round_up(1.05 * points.iter().map(f).fold(0.0, f64::max));
    let names = Names { title, x: x_name, y: y_name, x_ticks: true };
    let (mut p, axes) = Axes::draw(400.0, 300.0, [0.0, end(|v| v.0)], [0.0, end(|v| v.1)], names);
    let places: Vec<[f64; 2]> = points.iter().map(|(x, y, _)| axes.at(*x, *y)).collect();
    for at in &places {
        p.circle(*at, 4.0, &format!("fill=\"{}\" fill-opacity=\"0.85\"", color::BLUE));
    }
    // Each name where it hides least: above, right, left or below its point, clear of points and of names so far.
    let mut taken: Vec<[f64; 2]> = places.iter().map(|[x, y]| [*x, y + 4.0]).collect();
    for (at, (_, _, name)) in places.iter().zip(points) {
        let spots =
            [[0.0, -7.0], [12.0, 4.0], [-12.0, 4.0], [0.0, 16.0]].map(|d| [at[0] + d[0], at[1] + d[1]]);
        let free =
            |s: &&[f64; 2]| taken.iter().all(|t| (t[0] - s[0]).abs() > 11.0 || (t[1] - s[1]).abs() > 9.0);
        let spot = *spots.iter().find(free).unwrap_or(&spots[0]);
        taken.push(spot);
        p.text_over(spot, name, Type::TICK);
    }
    p
}
