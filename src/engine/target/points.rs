//! Points that were surveyed: any, each with a name.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::{
    Error, Result,
    spread::{IN_SPACE, Plane, Spread},
};

/// Named points in a right-handed frame of the user's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<(String, f64, f64, f64)>", into = "Vec<(String, f64, f64, f64)>")]
pub struct PointSet {
    names: Vec<String>,
    points: Vec<Point3<f64>>,
}

impl PointSet {
    /// From names and places; the index of a point is its position in the list.
    ///
    /// # Errors
    /// [`Error::Invalid`] for fewer than four points, a name that is there twice, a place that is not finite, and points on a
    /// line.
    pub fn new(list: Vec<(String, Point3<f64>)>) -> Result<Self> {
        if list.len() < 4 {
            return Err(Error::Invalid(format!("{} points: at least 4 are needed", list.len())));
        }
        let (names, points): (Vec<String>, Vec<Point3<f64>>) = list.into_iter().unzip();
        let mut sorted: Vec<&String> = names.iter().collect();
        sorted.sort();
        if let Some(twice) = sorted.windows(2).find(|w| w[0] == w[1]) {
            return Err(Error::Invalid(format!("the point {} is given twice: remove one of them", twice[0])));
        }
        if !IN_SPACE {
            return Ok(Self { names, points });
        }
        match Spread::of(&points) {
            None => Err(Error::Invalid("a point has no finite place".to_owned())),
            Some(Spread { sizes: [length, breadth, _], .. }) if breadth <= 1e-6 * length => {
                Err(Error::Invalid("the points lie on a line: add points beside it".to_owned()))
            }
            Some(_) => Ok(Self { names, points }),
        }
    }

    /// Name of each point, as it was given.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Each point.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.points
    }

    /// The plane that they are in or near.
    pub fn plane(&self) -> Plane {
        // `new` refuses what has none.
        Plane::of(&self.points)
            .unwrap_or(Plane { board_from_plane: crate::pose::Pose::identity(), relief: 0.0 })
    }

    /// Corners of a rectangle about the points in that plane.
    pub fn frame_in_board(&self) -> [Point3<f64>; 4] {
        let plane = self.plane();
        let flat = || plane.flattened(&self.points);
        let bound = |pick: fn(f64, f64) -> f64| flat().reduce(|a, b| a.zip_map(&b, pick)).unwrap_or_default();
        let (low, high) = (bound(f64::min), bound(f64::max));
        [[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]]
            .map(|[x, y]| plane.board_from_plane.apply(&Point3::new(x, y, 0.0)))
    }
}

impl TryFrom<Vec<(String, f64, f64, f64)>> for PointSet {
    type Error = Error;

    fn try_from(list: Vec<(String, f64, f64, f64)>) -> Result<Self> {
        Self::new(list.into_iter().map(|(name, x, y, z)| (name, Point3::new(x, y, z))).collect())
    }
}

impl From<PointSet> for Vec<(String, f64, f64, f64)> {
    fn from(set: PointSet) -> Self {
        set.names.into_iter().zip(set.points).map(|(name, p)| (name, p.x, p.y, p.z)).collect()
    }
}
