//! What is printed on a board: any kind that is detected.

use super::{
    Board, Levels,
    coverage::Squares,
    shapes::{Shape, Shapes},
};
use crate::{
    Error, Result,
    target::{BoardSize, Target},
};

/// Most points or markers along a side.
const LARGEST: u32 = 500;

/// A printed board. Coordinates of the pattern are those of the board frame, in squares, markers or spacings.
pub struct Print {
    pattern: Pattern,
    unit: f64,
    background: f32,
}

/// What is exactly known of its area.
enum Pattern {
    Squares(Squares),
    Shapes(Shapes),
}

impl Print {
    /// The checkerboard of a scene.
    pub(super) fn checkerboard(board: &Board) -> Self {
        let pattern = Pattern::Squares(Squares::new(board.size, board.margin, board.levels));
        Self { pattern, unit: board.square, background: f32::from(board.levels.background) }
    }

    /// A board with a white border of `margin` squares, markers or spacings. What of a target is not known is as usual: it is black on
    /// white, and a ChArUco board of either layout as of OpenCV 4.6 and later.
    ///
    /// # Errors
    /// [`Error::Invalid`] for known points, which no one has printed, a board of more than 500 points or markers along a side, and a
    /// dictionary that has too few markers.
    pub fn of(target: &Target, margin: f64, levels: Levels) -> Result<Self> {
        let checked = |size: BoardSize| {
            if (1..=LARGEST).contains(&size.cols) && (1..=LARGEST).contains(&size.rows) {
                return Ok(());
            }
            Err(Error::Invalid(format!("a board of {size} cannot be drawn: at most {LARGEST} along a side")))
        };
        let (pattern, unit) = match target {
            Target::Checkerboard { size, square } => {
                checked(*size)?;
                (Pattern::Squares(Squares::new(*size, margin, levels)), *square)
            }
            Target::Markers { board, scale } => {
                checked(board.size())?;
                let black = board.ink()?.into_iter();
                let list = black.map(|[x, y, w, h]| Shape::Rectangle([[x, x + w], [y, y + h]])).collect();
                (Pattern::Shapes(Shapes::new(list, margin, levels)), *scale)
            }
            Target::Circles { board, spacing, radius } => {
                checked(board.size)?;
                let centers = board.points(1.0).into_iter();
                let list = centers.map(|c| Shape::Disc([c.x, c.y], radius / spacing)).collect();
                (Pattern::Shapes(Shapes::new(list, margin, levels)), *spacing)
            }
            Target::Points { .. } => {
                return Err(Error::Invalid(
                    "known points cannot be drawn: what is printed there is not known".to_owned(),
                ));
            }
        };
        Ok(Self { pattern, unit, background: f32::from(levels.background) })
    }

    /// Length of one unit of the pattern, in the unit of the target.
    pub(super) const fn unit(&self) -> f64 {
        self.unit
    }

    /// Grey value beside the board.
    pub(super) const fn background(&self) -> f32 {
        self.background
    }

    /// Smallest and largest x and y of the printed sheet.
    pub(super) fn ends(&self) -> [[f64; 2]; 2] {
        match &self.pattern {
            Pattern::Squares(p) => p.ends(),
            Pattern::Shapes(p) => p.ends(),
        }
    }

    /// Grey value of a point.
    pub(super) fn at(&self, b: [f64; 2]) -> f32 {
        match &self.pattern {
            Pattern::Squares(p) => p.at(b),
            Pattern::Shapes(p) => p.at(b),
        }
    }

    /// Grey value of a pixel with the map `center + j·[−½, ½]²` where no edge comes near it.
    pub(super) fn uniform(&self, center: [f64; 2], j: [[f64; 2]; 2]) -> Option<f32> {
        match &self.pattern {
            Pattern::Squares(p) => p.uniform(center, j),
            Pattern::Shapes(p) => p.uniform(center, j),
        }
    }

    /// Mean over the parallelogram `center + j·[−½, ½]²`.
    pub(super) fn mean(&self, center: [f64; 2], j: [[f64; 2]; 2]) -> f32 {
        match &self.pattern {
            Pattern::Squares(p) => p.mean(center, j),
            Pattern::Shapes(p) => p.mean(center, j),
        }
    }
}

#[cfg(test)]
mod tests;
