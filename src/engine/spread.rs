//! How points lie in space: their middle, their principal axes, and the plane that they are in or near.

use nalgebra::{Matrix3, Point3, Rotation3, SymmetricEigen, Vector2, Vector3};

use super::{order, pose::Pose};

/// Whether points that are not in a plane z = 0 are calibrated. Not in a browser: nothing brings them there, and the page is spared
/// their code.
pub const IN_SPACE: bool = cfg!(not(target_arch = "wasm32"));

/// Middle and principal axes of points.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    /// Board from a frame in the middle of the points, x along their longest axis, z along the shortest; its z does not point
    /// against the board's.
    pub board_from_axes: Pose,
    /// Standard deviations along the axes, largest first.
    pub sizes: [f64; 3],
}

impl Spread {
    /// `None` without points, or where one is not finite.
    pub fn of(points: &[Point3<f64>]) -> Option<Self> {
        let n = points.len() as f64;
        let middle = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / n;
        let scatter =
            points.iter().map(|p| p.coords - middle).fold(Matrix3::zeros(), |s, d| s + d * d.transpose()) / n;
        if !scatter.iter().all(|x| x.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::new(scatter);
        let mut by_size = [0, 1, 2];
        order::by(&mut by_size, |i| [-eigen.eigenvalues[*i]]);
        let [x, _, z] = by_size.map(|i| eigen.eigenvectors.column(i).into_owned());
        let z = if z.z < 0.0 { -z } else { z };
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
        Some(Self {
            board_from_axes: Pose { rotation, translation: middle },
            sizes: by_size.map(|i| eigen.eigenvalues[i].max(0.0).sqrt()),
        })
    }
}

/// The plane that points are in or near.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Board from a frame whose xy plane it is.
    pub board_from_plane: Pose,
    /// How far the points are from it, as a share of their breadth in it (standard deviations); 0 where all are in the board's own.
    pub relief: f64,
}

impl Plane {
    /// Relief from which points may determine more than a plane does.
    pub const UNEVEN: f64 = 1e-3;
    /// Relief from which they determine it well, and are taken for a solid thing.
    pub const SOLID: f64 = 0.05;

    /// That of points; a board with z = 0 keeps its own frame. `None` where one is not finite or there is none, and for all others
    /// where they are not calibrated ([`IN_SPACE`]).
    pub fn of(points: &[Point3<f64>]) -> Option<Self> {
        if !points.is_empty() && points.iter().all(|p| p.z == 0.0) {
            return Some(Self { board_from_plane: Pose::identity(), relief: 0.0 });
        }
        if !IN_SPACE {
            return None;
        }
        let Spread { board_from_axes, sizes: [_, breadth, depth] } = Spread::of(points)?;
        Some(Self { board_from_plane: board_from_axes, relief: depth / breadth.max(f64::MIN_POSITIVE) })
    }

    /// Whether the points may determine more than a plane does.
    pub fn is_uneven(&self) -> bool {
        IN_SPACE && self.relief > Self::UNEVEN
    }

    /// Whether the points determine far more than a plane does.
    pub fn is_solid(&self) -> bool {
        IN_SPACE && self.relief > Self::SOLID
    }

    /// The nearest points of the plane, in its own frame.
    pub fn flattened<'a>(&self, points: &'a [Point3<f64>]) -> impl Iterator<Item = Vector2<f64>> + use<'a> {
        let plane_from_board = self.board_from_plane.inverse();
        points.iter().map(move |p| plane_from_board.apply(p).xy().coords)
    }

    /// The pose of the board from that of the plane.
    pub fn camera_from_board(&self, camera_from_plane: Pose) -> Pose {
        // A board keeps its bits.
        if self.board_from_plane == Pose::identity() {
            return camera_from_plane;
        }
        camera_from_plane * self.board_from_plane.inverse()
    }

    /// Normal in the board frame.
    pub fn normal_in_board(&self) -> Vector3<f64> {
        self.board_from_plane.rotation * Vector3::z()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_and_solids_are_told_apart() {
        let grid = |z: f64| -> Vec<Point3<f64>> {
            (0..20).map(|i| Point3::new(f64::from(i % 5), f64::from(i / 5), z * f64::from(i % 3))).collect()
        };
        let turn = Pose::from_euler_deg([30.0, 50.0, 20.0], Vector3::new(1e3, -2e3, 5e3));
        let turned = |z: f64| Plane::of(&grid(z).iter().map(|p| turn.apply(p)).collect::<Vec<_>>()).unwrap();
        assert!(Plane::of(&grid(0.0)).unwrap().board_from_plane == Pose::identity());
        let plane = turned(0.0);
        assert!(plane.relief < 1e-6 && !plane.is_solid());
        let normal = turn.rotation * Vector3::z();
        assert!((plane.normal_in_board().dot(&normal).abs() - 1.0).abs() < 1e-9);
        assert!(turned(0.01).relief > Plane::UNEVEN && !turned(0.01).is_solid() && turned(1.0).is_solid());
        // Distances in the plane are those of the points.
        let flat: Vec<_> =
            plane.flattened(&grid(0.0).iter().map(|p| turn.apply(p)).collect::<Vec<_>>()).collect();
        assert!(((flat[19] - flat[0]).norm() - 5.0).abs() < 1e-9);
        assert!(Plane::of(&[]).is_none() && Plane::of(&[Point3::new(f64::NAN, 0.0, 1.0)]).is_none());
    }
}
