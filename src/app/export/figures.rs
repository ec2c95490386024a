//! Figures of the report as files.

use crate::calib::{
    figure::{Panel, THRESHOLD_PX, coverage_density, coverage_points, cumulative, error_bars, histogram},
    report::{Report, Solution},
};

/// A figure that can be saved.
pub(super) struct Figure {
    /// On its button; with underscores, the name of its file.
    pub(super) name: &'static str,
    draw: fn(&Report, &Solution) -> Panel,
}

/// All of them.
pub(super) const FIGURES: &[Figure] = &[
    Figure {
        name: "errors by picture",
        draw: |report, solution| error_bars(&report.bars(), solution.rms_px, THRESHOLD_PX),
    },
    Figure { name: "error histogram", draw: |report, _| histogram(&report.errors_px()) },
    Figure {
        name: "error share",
        draw: |report, solution| cumulative(&report.errors_px(), solution.stats.p95),
    },
    Figure {
        name: "corners",
        draw: |report, solution| coverage_points(&report.corners_px(), solution.camera.size_px),
    },
    Figure {
        name: "density",
        draw: |report, solution| coverage_density(&report.corners_px(), solution.camera.size_px, 20),
    },
];

impl Figure {
    /// Its file: name and SVG.
    pub(super) fn file(&self, report: &Report, solution: &Solution) -> (String, std::sync::Arc<Vec<u8>>) {
        let svg = (self.draw)(report, solution).svg();
        (format!("{}.svg", self.name.replace(' ', "_")), std::sync::Arc::new(svg.into_bytes()))
    }
}
