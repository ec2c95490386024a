//! How a board may be held, and whether a camera would see all of it.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Matrix3x2, Point3, Rotation3, Unit, Vector2, Vector3};

use crate::calib::{camera::Camera, pose::Pose, solution::Calibration, stats, target::Target};

/// Distances that are tried, as multiples of the usual one.
pub(super) const TIMES: [f64; 5] = [0.5, 2.0 / 3.0, 1.0, 1.5, 2.0];
/// How much nearer or farther than any board so far: focus and light were never tried there.
const BEYOND: f64 = 1.5;
/// Strongest tilt against the optical axis, degrees.
pub(super) const MOST_TILT_DEG: f64 = 55.0;
/// Most oblique look at any part of the board: cos 62°.
const LEAST_COSINE: f64 = 0.47;
/// Smallest distance of neighbouring points in the picture, px.
const LEAST_SPACING_PX: f64 = 10.0;
/// Steps from the middle of the picture to its border.
const STEPS: usize = 16;

/// How a board is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hold {
    /// Towards which side of the picture, −1, 0 or 1 to the right and downwards.
    pub(super) side: [i8; 2],
    /// How far towards it, as a share of what is possible.
    pub(super) reach: f64,
    /// Distance of its middle, as a multiple of the usual one.
    pub(super) times: f64,
    /// Tilt against the optical axis, degrees.
    pub(super) tilt_deg: f64,
    /// Direction in the picture of the side that is away, degrees from right to down.
    pub(super) away_deg: f64,
    /// Rotation in its plane, degrees.
    pub(super) roll_deg: f64,
}

impl Hold {
    fn rotation(&self) -> Rotation3<f64> {
        let (sin, cos) = self.away_deg.to_radians().sin_cos();
        let axis = Unit::new_unchecked(Vector3::new(sin, -cos, 0.0));
        Rotation3::from_axis_angle(&axis, self.tilt_deg.to_radians())
            * Rotation3::from_axis_angle(&Vector3::z_axis(), self.roll_deg.to_radians())
    }
}

/// The camera, the board, and how it was held so far.
pub(super) struct Studio<'a> {
    pub(super) camera: &'a Camera,
    /// All points, in the board frame.
    pub(super) points: Vec<Point3<f64>>,
    center: Point3<f64>,
    /// Four corners of the board, then the middles of its sides, a spacing beyond the points: most of the outer squares.
    outline: [Point3<f64>; 8],
    /// Mean distance of neighbouring points.
    spacing: f64,
    /// Median distance so far.
    pub(super) usual: f64,
    /// Distances that may be asked for.
    distances: [f64; 2],
    /// Angle from the axis at which the model folds, rad.
    fold_rad: f64,
    /// For each side the rays of pixels from the middle of the picture to there; shorter where the model ends before.
    rays: [Vec<Vector3<f64>>; 9],
}

impl<'a> Studio<'a> {
    /// `None` where nothing was seen yet, or the target is no flat board.
    pub(super) fn new(calibration: &'a Calibration, target: &Target) -> Option<Self> {
        if target.is_solid() {
            return None;
        }
        let camera = &calibration.camera;
        let distance =
            |v: &crate::calib::solution::View| stats::stance(&v.camera_from_board, target).distance;
        let mut so_far: Vec<f64> = calibration.views.iter().map(distance).collect();
        so_far.sort_by(f64::total_cmp);
        let (nearest, farthest) = (*so_far.first()?, *so_far.last()?);
        let [[x0, y0], [x1, y1]] = target.extent();
        let points = target.points_in_board();
        let spacing = ((x1 - x0) * (y1 - y0) / points.len() as f64).sqrt();
        let center = target.center_in_board();
        let half = [(x1 - x0) / 2.0 + spacing, (y1 - y0) / 2.0 + spacing];
        let at = |x: i8, y: i8| center + Vector3::new(f64::from(x) * half[0], f64::from(y) * half[1], 0.0);
        Some(Self {
            camera,
            points,
            center,
            outline: [at(-1, -1), at(1, -1), at(1, 1), at(-1, 1), at(0, -1), at(1, 0), at(0, 1), at(-1, 0)],
            spacing,
            usual: stats::quantile(&so_far, 0.5),
            distances: [nearest / BEYOND, farthest * BEYOND],
            fold_rad: camera.fold_rad().min(FRAC_PI_2),
            rays: std::array::from_fn(|k| rays(camera, [k as i8 % 3 - 1, k as i8 / 3 - 1])),
        })
    }

    /// Where the board is then; `None` where it cannot be held so, or is not seen well enough.
    pub(super) fn pose(&self, hold: &Hold) -> Option<Pose> {
        let distance = self.usual * hold.times;
        if !(self.distances[0]..=self.distances[1]).contains(&distance) {
            return None;
        }
        let rotation = hold.rotation();
        let rays = &self.rays[((hold.side[1] + 1) * 3 + hold.side[0] + 1) as usize];
        let at = |step: usize| {
            let translation = rays.get(step)? * distance - rotation * self.center.coords;
            Some(Pose { rotation, translation }).filter(|pose| self.is_inside(pose))
        };
        // The board is moved towards the side until it meets the border; what fits, fits before.
        let (mut low, mut high) = (0, rays.len());
        at(0)?;
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            *if at(middle).is_some() { &mut low } else { &mut high } = middle;
        }
        // A side that cannot be approached is the middle.
        if low == 0 && hold.side != [0, 0] {
            return None;
        }
        at((low as f64 * hold.reach).round() as usize).filter(|pose| self.is_distinct(pose))
    }

    fn is_inside(&self, pose: &Pose) -> bool {
        let [w, h] = self.camera.size_px.map(f64::from);
        self.outline.iter().all(|p| {
            let p = pose.apply(p);
            p.z > 0.0
                && p.x.hypot(p.y).atan2(p.z) < self.fold_rad
                && self
                    .camera
                    .project(&p)
                    .is_some_and(|px| px.x >= 0.0 && px.y >= 0.0 && px.x <= w - 1.0 && px.y <= h - 1.0)
        })
    }

    /// Whether neighbouring points are far enough from each other, and nowhere looked at along the board.
    fn is_distinct(&self, pose: &Pose) -> bool {
        let sides: Matrix3x2<f64> = pose.matrix().fixed_columns::<2>(0).into();
        let normal = pose.matrix().column(2);
        self.outline[..4].iter().all(|p| {
            let p = pose.apply(p).coords;
            let Some(there) = (self.camera.spec().project)(&self.camera.params, &p) else { return false };
            let by_board = there.by_point * sides * self.spacing;
            // The smaller singular value of a 2 × 2 matrix.
            let (whole, area) = (by_board.norm_squared(), by_board.determinant());
            let least = ((whole - (whole * whole - 4.0 * area * area).max(0.0).sqrt()) / 2.0).max(0.0).sqrt();
            least >= LEAST_SPACING_PX && normal.dot(&p) >= LEAST_COSINE * p.norm()
        })
    }

    /// Everything that is tried at first.
    pub(super) fn all(&self) -> impl Iterator<Item = Hold> {
        let sides = (-1..=1).flat_map(|y| (-1..=1).map(move |x| [x, y]));
        let tilts = [0.0, 30.0, 50.0].into_iter().flat_map(|tilt| {
            let directions = if tilt > 0.0 { 8 } else { 1 };
            (0..directions).map(move |k| (tilt, 45.0 * f64::from(k)))
        });
        let tilts: Vec<_> = tilts.collect();
        sides.flat_map(move |side| {
            let tilts = tilts.clone();
            TIMES.into_iter().flat_map(move |times| {
                tilts.clone().into_iter().flat_map(move |(tilt_deg, away_deg)| {
                    [0.0, 90.0].map(|roll_deg| Hold { side, reach: 1.0, times, tilt_deg, away_deg, roll_deg })
                })
            })
        })
    }

    /// What is tried beside a good one.
    pub(super) fn beside(&self, hold: &Hold) -> Vec<Hold> {
        let mut list = Vec::new();
        for by in [-10.0, -5.0, 5.0, 10.0] {
            let tilt_deg = hold.tilt_deg + by;
            if (10.0..=MOST_TILT_DEG).contains(&tilt_deg) {
                list.push(Hold { tilt_deg, ..*hold });
            }
        }
        for by in [-45.0, 45.0] {
            list.push(Hold { roll_deg: (hold.roll_deg + by).rem_euclid(180.0), ..*hold });
            if hold.tilt_deg > 0.0 {
                list.push(Hold { away_deg: (hold.away_deg + by).rem_euclid(TAU.to_degrees()), ..*hold });
            }
        }
        if hold.side != [0, 0] {
            list.extend([0.5, 0.75].map(|reach| Hold { reach, ..*hold }));
        }
        list
    }
}

/// Unit rays from the middle of the picture towards a side of it.
fn rays(camera: &Camera, side: [i8; 2]) -> Vec<Vector3<f64>> {
    let half = camera.size_px.map(|n| (f64::from(n) - 1.0) / 2.0);
    let steps = if side == [0, 0] { 1 } else { STEPS };
    let ray = |step: usize| {
        let share = step as f64 / STEPS as f64;
        let px = Vector2::from([0, 1].map(|k| half[k] * (1.0 + share * f64::from(side[k]))));
        camera.unproject(&px)
    };
    (0..steps).map_while(ray).collect()
}
