//! What faults are made of: each an elementary way in which a corner can be displaced.

use nalgebra::{Point3, Vector2, Vector3};

use crate::calib::camera::Projection;

/// One elementary displacement; its unknown is in the unit given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// Another focal length, relative.
    Focal,
    /// Another principal point, px.
    CentreX,
    CentreY,
    /// Rows that are read one after another while the picture moves: px over the height of the picture.
    RowsX,
    RowsY,
    /// A bowed board: its height at the end of its longer half, in the unit of the square, as s², st, t².
    BowXx,
    BowXy,
    BowYy,
    /// Squares that are longer than they are high, relative.
    Aspect,
    /// Terms of a lens, px in the corner of the picture: radial of degrees 3 to 9, prism of degrees 2 and 4, decentring, skew, unequal scales.
    Radial3,
    Radial5,
    Radial7,
    Radial9,
    PrismX,
    PrismY,
    Prism4X,
    Prism4Y,
    DecentredX,
    DecentredY,
    Skew,
    Stretch,
}

/// A corner as the columns see it.
pub(super) struct Place<'a> {
    pub(super) there: &'a Projection,
    pub(super) params: &'a [f64],
    pub(super) size_px: [u32; 2],
    /// On the board, its middle 0 and half its longer side 1.
    pub(super) flat: Vector3<f64>,
    /// Normal of the board, in the camera frame.
    pub(super) normal: Vector3<f64>,
    /// Half the longer side along the columns, in the camera frame.
    pub(super) along: Vector3<f64>,
}

impl Column {
    pub(super) const ALL: [Self; 21] = [
        Self::Focal,
        Self::CentreX,
        Self::CentreY,
        Self::RowsX,
        Self::RowsY,
        Self::BowXx,
        Self::BowXy,
        Self::BowYy,
        Self::Aspect,
        Self::Radial3,
        Self::Radial5,
        Self::Radial7,
        Self::Radial9,
        Self::PrismX,
        Self::PrismY,
        Self::Prism4X,
        Self::Prism4Y,
        Self::DecentredX,
        Self::DecentredY,
        Self::Skew,
        Self::Stretch,
    ];
    pub(super) const COUNT: usize = Self::ALL.len();
    /// Terms of a lens.
    pub(super) const LENS: std::ops::Range<usize> = 9..21;

    pub(super) const fn index(self) -> usize {
        self as usize
    }

    /// Whether it displaces the place in the picture, whatever is seen there.
    pub(super) const fn in_picture(self) -> bool {
        self.index() >= Self::LENS.start || matches!(self, Self::RowsX | Self::RowsY)
    }

    /// The displacement by the terms of a lens and by rows that are read late, at a place in the picture.
    pub(super) fn in_picture_at(
        self,
        px: &Vector2<f64>,
        centre: [f64; 2],
        size_px: [u32; 2],
    ) -> Vector2<f64> {
        let [w, h] = size_px.map(f64::from);
        let rows = (px.y - (h - 1.0) / 2.0) / h;
        let reach = 0.5 * w.hypot(h);
        let [x, y] = [(px.x - centre[0]) / reach, (px.y - centre[1]) / reach];
        let r2 = x * x + y * y;
        let radial = |n| Vector2::new(x, y) * r2.powi(n);
        match self {
            Self::RowsX => Vector2::new(rows, 0.0),
            Self::RowsY => Vector2::new(0.0, rows),
            Self::Radial3 => radial(1),
            Self::Radial5 => radial(2),
            Self::Radial7 => radial(3),
            Self::Radial9 => radial(4),
            Self::PrismX => Vector2::new(r2, 0.0),
            Self::PrismY => Vector2::new(0.0, r2),
            Self::Prism4X => Vector2::new(r2 * r2, 0.0),
            Self::Prism4Y => Vector2::new(0.0, r2 * r2),
            Self::DecentredX => Vector2::new(2.0 * x * x, 2.0 * x * y),
            Self::DecentredY => Vector2::new(2.0 * x * y, 2.0 * y * y),
            Self::Skew => Vector2::new(y, 0.0),
            Self::Stretch => Vector2::new(x, 0.0),
            _ => Vector2::zeros(),
        }
    }

    /// Puts a value into the camera and the board, as far as it belongs there.
    pub(super) fn apply(
        self,
        value: f64,
        flat: &Vector3<f64>,
        normal: &Vector3<f64>,
        params: &mut [f64],
        point: &mut Point3<f64>,
        half: f64,
    ) {
        match self {
            Self::Focal => params[..2].iter_mut().for_each(|f| *f *= 1.0 + value),
            Self::CentreX => params[2] += value,
            Self::CentreY => params[3] += value,
            Self::Aspect => point.x += value * flat.x * half,
            _ => *point += *normal * (value * self.height(flat)),
        }
    }

    /// Height of a bowed board.
    pub(super) fn height(self, flat: &Vector3<f64>) -> f64 {
        match self {
            Self::BowXx => flat.x * flat.x,
            Self::BowXy => flat.x * flat.y,
            Self::BowYy => flat.y * flat.y,
            _ => 0.0,
        }
    }
}

impl Place<'_> {
    /// ∂px/∂unknown.
    pub(super) fn column(&self, column: Column) -> Vector2<f64> {
        let by = &self.there.by_params;
        match column {
            Column::Focal => by[0] * self.params[0] + by[1] * self.params[1],
            Column::CentreX => by[2],
            Column::CentreY => by[3],
            Column::BowXx | Column::BowXy | Column::BowYy => {
                self.there.by_point * self.normal * column.height(&self.flat)
            }
            Column::Aspect => self.there.by_point * self.along * self.flat.x,
            _ => column.in_picture_at(&self.there.px, [self.params[2], self.params[3]], self.size_px),
        }
    }
}
