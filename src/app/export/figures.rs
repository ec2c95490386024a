//! Figures of the report as files.

use std::sync::Arc;

use super::content::Content;
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
        draw: |report, solution| {
            coverage_points(&report.corners_px(), solution.camera.size_px, solution.safe_px())
        },
    },
    Figure {
        name: "density",
        draw: |report, solution| coverage_density(&report.corners_px(), solution.camera.size_px, 20),
    },
];

/// How a figure is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Kind {
    /// Lines that stay sharp.
    #[default]
    Svg,
    /// Pixels.
    Png,
}

impl Figure {
    /// Its file: name and content.
    pub(super) fn file(&self, report: &Report, solution: &Solution, kind: Kind) -> (String, Content) {
        let svg = (self.draw)(report, solution).svg();
        let name = self.name.replace(' ', "_");
        match kind {
            Kind::Svg => (format!("{name}.svg"), Content::bytes(svg.into_bytes())),
            Kind::Png => (format!("{name}.png"), Content::Png(Arc::new(svg))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::png::png, *};
    use crate::calib::figure::Bar;

    #[test]
    fn a_figure_has_its_words_as_pixels() {
        let bar = |mean_px| Bar { name: "1".to_owned(), mean_px, max_px: 2.0 * mean_px };
        let svg = error_bars(&[bar(0.2), bar(0.3)], 0.3, THRESHOLD_PX).svg();
        let read = |svg: &str| image::load_from_memory(&png(svg).unwrap()).unwrap().into_luma8();
        let with = read(&svg);
        let dark = |picture: &image::GrayImage| picture.pixels().filter(|p| p.0[0] < 128).count();
        // The same without its text has far less ink.
        let mut without = String::new();
        let mut rest = svg.as_str();
        while let Some((before, after)) = rest.split_once("<text") {
            without += before;
            rest = after.split_once("</text>").unwrap().1;
        }
        let without = read(&(without + rest));
        assert_eq!(with.dimensions(), without.dimensions());
        assert!(dark(&with) > dark(&without) + 1000, "{} {}", dark(&with), dark(&without));
        assert!(png("<svg").is_err());
    }
}
