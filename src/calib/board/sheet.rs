//! Which board is to be printed.

use super::{Design, Kind, MAX_MM};
use crate::calib::{
    Error, Result,
    marker::{board::MarkerBoard, dictionary::Dictionary},
    target::{BoardSize, Length, Target},
};

/// A board to print.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// The board.
    pub design: Design,
    /// What [`super::Kind::length`] says.
    pub square: Length,
}

impl Sheet {
    /// A board with what is usual for its kind.
    pub const fn new(kind: Kind, size: BoardSize, square: Length) -> Self {
        Self { design: Design { legacy: Some(false), ..Design::new(kind, size) }, square }
    }

    /// With a length within the square ([`super::Kind::inner`]) in place of its usual share.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a length has no physical unit.
    pub fn with_inner(mut self, inner: Length) -> Result<Self> {
        self.design.inner = Some(mm(inner)? / self.square_mm()?);
        Ok(self)
    }

    /// Edge of a square, tag or marker, or the spacing, mm.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the length has no physical unit.
    pub fn square_mm(&self) -> Result<f64> {
        mm(self.square)
    }

    /// The board, its lengths in mm: as it is found again.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a length has no physical unit or does not fit, for a board that cannot be found, one that is larger than 5 m,
    /// and a dictionary that has too few markers.
    pub fn target(&self) -> Result<Target> {
        let (size, scale) = (self.design.size, self.square_mm()?);
        if scale < 0.1 {
            return Err(Error::Invalid(format!(
                "squares of {} cannot be printed: at least 0.1 mm",
                self.square
            )));
        }
        // Before anything is counted: a board of a million markers is refused by its size.
        let across = [size.cols, size.rows].map(|n| f64::from(n.saturating_add(1)) * scale);
        if across.iter().any(|b| b.is_nan() || *b > MAX_MM) {
            return Err(Error::Invalid(format!(
                "{size} squares of {} make a board of {:.2} x {:.2} m, more than 5 m: choose fewer or smaller squares",
                self.square,
                across[0] / 1000.0,
                across[1] / 1000.0
            )));
        }
        self.design.target(self.square, scale)
    }

    /// What is printed, in lines of words: ASCII.
    ///
    /// # Errors
    /// As [`Sheet::target`].
    pub fn words(&self) -> Result<Vec<String>> {
        let (size, square) = (self.design.size, self.square);
        let length = |share: f64| square.times(share);
        let Target::Markers { board, .. } = self.target()? else {
            return Ok(vec![match self.target()? {
                Target::Circles { board, spacing, radius } => {
                    let diameter = length(2.0 * radius / spacing);
                    format!("circle grid {board}, spacing {square}, diameter {diameter}")
                }
                _ => format!("{size} inner corners, square {square}"),
            }]);
        };
        let ids = board.ids();
        let last = ids.end.saturating_sub(1);
        let codes = |d: Dictionary| format!("dictionary {d}, ids {} to {last}", ids.start);
        Ok(match board {
            MarkerBoard::Charuco(b) => {
                let layout = match (b.rows.is_multiple_of(2), b.legacy == Some(true)) {
                    (false, _) => "",
                    (true, false) => ", layout since OpenCV 4.6",
                    (true, true) => ", layout before OpenCV 4.6",
                };
                vec![
                    format!("ChArUco {size} squares, square {square}, marker {}", length(b.marker)),
                    format!("{}{layout}", codes(b.dictionary)),
                ]
            }
            MarkerBoard::AprilGrid(b) => vec![
                format!(
                    "AprilGrid {size} tags, tag {square}, gap {} (spacing {:.3})",
                    length(b.spacing),
                    b.spacing
                ),
                format!("{}, border {} cells", codes(b.dictionary), b.border),
            ],
            MarkerBoard::ArucoGrid(b) => vec![
                format!("ArUco grid {size} markers, marker {square}, gap {}", length(b.gap)),
                codes(b.dictionary),
            ],
        })
    }
}

fn mm(length: Length) -> Result<f64> {
    let metres = length.unit.metres().ok_or_else(|| {
        Error::Invalid(format!(
            "a printed board needs the size of its squares with a unit: write for example {}mm",
            length.value
        ))
    })?;
    Ok(1000.0 * metres * length.value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(kind: Kind, size: &str, square: &str) -> Sheet {
        Sheet::new(kind, size.parse().unwrap(), square.parse().unwrap())
    }

    #[test]
    fn sheets_say_what_they_are() {
        for (kind, size, square, words) in [
            (Kind::Checkerboard, "9x6", "2.5cm", vec!["9x6 inner corners, square 2.5 cm"]),
            (
                Kind::Charuco,
                "11x8",
                "20mm",
                vec![
                    "ChArUco 11x8 squares, square 20 mm, marker 15 mm",
                    "dictionary 5x5_250, ids 0 to 43, layout since OpenCV 4.6",
                ],
            ),
            (
                Kind::AprilGrid,
                "6x6",
                "1in",
                vec![
                    "AprilGrid 6x6 tags, tag 1 in, gap 0.3 in (spacing 0.300)",
                    "dictionary 36h11, ids 0 to 35, border 2 cells",
                ],
            ),
            (
                Kind::ArucoGrid,
                "5x7",
                "30mm",
                vec!["ArUco grid 5x7 markers, marker 30 mm, gap 12 mm", "dictionary 5x5_250, ids 0 to 34"],
            ),
            (Kind::Circles, "7x6", "20mm", vec!["circle grid symmetric 7x6, spacing 20 mm, diameter 12 mm"]),
            (
                Kind::AsymmetricCircles,
                "4x11",
                "20mm",
                vec!["circle grid asymmetric 4x11, spacing 20 mm, diameter 16.970563 mm"],
            ),
        ] {
            assert_eq!(sheet(kind, size, square).words().unwrap(), words);
            assert_eq!(kind.to_string().parse(), Ok(kind));
        }
        let design = "charuco:5x4:4x4_100:first=7:legacy".parse().unwrap();
        let with = Sheet { design, square: "2.5cm".parse().unwrap() };
        assert_eq!(
            with.with_inner("18mm".parse().unwrap()).unwrap().words().unwrap(),
            [
                "ChArUco 5x4 squares, square 2.5 cm, marker 1.8 cm",
                "dictionary 4x4_100, ids 7 to 16, layout before OpenCV 4.6"
            ]
        );
    }

    #[test]
    fn what_cannot_be_printed_is_refused() {
        let inner = |kind, inner: &str| {
            let sheet = sheet(kind, "5x4", "20mm").with_inner(inner.parse().unwrap());
            sheet.and_then(|s| s.target()).unwrap_err().to_string()
        };
        assert_eq!(
            inner(Kind::Charuco, "20mm"),
            "a marker of 20 mm does not fit a board of 20 mm: give 6 mm to 19 mm"
        );
        assert!(inner(Kind::AprilGrid, "1mm").contains("a gap of 1 mm"));
        assert!(inner(Kind::Circles, "20mm").contains("give 2 mm to 18 mm"));
        assert!(inner(Kind::ArucoGrid, "3").contains("with a unit: write for example 3mm"));
        assert!("chess".parse::<Kind>().unwrap_err().to_string().contains("charuco, aprilgrid"));
    }
}
