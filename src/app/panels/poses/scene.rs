//! What stands where, in one frame, in the unit of the square.

use nalgebra::{Point3, Vector3};

use crate::{
    app::state::State,
    calib::{
        camera::Camera,
        number::{degrees, significant},
        observation::FrameId,
        pose::Pose,
        target::Target,
    },
};

/// A board, or the camera seen from it.
#[derive(Clone, Debug)]
pub(super) struct Thing {
    pub(super) id: FrameId,
    /// Outline; the first point is the corner with index 0.
    pub(super) outline: Vec<Point3<f64>>,
    /// What is said when the pointer is over it.
    pub(super) tip: String,
}

/// Everything that is drawn.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    /// Boards around the camera, or picture planes of cameras around the board.
    pub(super) boards: Vec<Thing>,
    /// Lines of the thing in the middle.
    pub(super) middle: Vec<[Point3<f64>; 2]>,
    /// Tips of the cameras around a board.
    pub(super) tips: Vec<Option<Point3<f64>>>,
    /// Middle and radius of all of it.
    pub(super) sphere: (Point3<f64>, f64),
    /// Lowest point, where the floor is (y points down).
    pub(super) floor_y: f64,
    /// Distance of the floor's lines.
    pub(super) floor_step: f64,
    pub(super) unit: &'static str,
}

impl Scene {
    /// Of the present answer; none without a camera.
    pub(super) fn of(state: &State) -> Option<Self> {
        let (answer, solution) = state.data.solved()?;
        let report = answer.report();
        let target = report.settings.target()?;
        let views: Vec<(FrameId, Pose, String)> = report
            .frames
            .iter()
            .zip(&answer.ids)
            .filter_map(|(f, id)| {
                let pose = f.camera_from_board()?;
                let tip = format!(
                    "{}: {} {} away, tilted {}°",
                    state.name(*id),
                    significant(f.distance?, 3),
                    report.settings.unit.name(),
                    degrees(f.tilt_rad?)
                );
                f.included.then_some((*id, pose, tip))
            })
            .collect();
        let mut scene = if state.screen.orbit.board_centric {
            around_board(&views, &target, &solution.camera)
        } else {
            around_camera(&views, &target, &solution.camera)
        };
        scene.unit = report.settings.unit.name();
        Some(scene)
    }
}

/// Corners of the board's outer squares, the one beside corner 0 first; of surveyed points a frame about them in the plane that they
/// are in or near.
fn outline(target: &Target) -> [Point3<f64>; 4] {
    let [[x0, y0], [x1, y1]] = target.extent();
    let rim = match target {
        Target::Checkerboard { square, .. } => *square,
        Target::Markers { scale, .. } => 0.5 * scale,
        Target::Circles { spacing, .. } => *spacing,
        Target::Points { points } => return points.frame_in_board(),
    };
    let (x0, y0, x1, y1) = (x0 - rim, y0 - rim, x1 + rim, y1 + rim);
    [Point3::new(x0, y0, 0.0), Point3::new(x1, y0, 0.0), Point3::new(x1, y1, 0.0), Point3::new(x0, y1, 0.0)]
}

/// Picture plane of a camera at a depth.
fn plane(camera: &Camera, depth: f64) -> [Point3<f64>; 4] {
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px.map(f64::from);
    let at = |x: f64, y: f64| Point3::new((x - cx) / fx * depth, (y - cy) / fy * depth, depth);
    [at(0.0, 0.0), at(w, 0.0), at(w, h), at(0.0, h)]
}

fn frustum(tip: Point3<f64>, corners: &[Point3<f64>]) -> Vec<[Point3<f64>; 2]> {
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    sides.flat_map(|(a, b)| [[tip, *a], [*a, *b]]).collect()
}

fn around_camera(views: &[(FrameId, Pose, String)], target: &Target, camera: &Camera) -> Scene {
    let corners = outline(target);
    let boards: Vec<Thing> = views
        .iter()
        .map(|(id, pose, tip)| Thing {
            id: *id,
            outline: corners.iter().map(|p| pose.apply(p)).collect(),
            tip: tip.clone(),
        })
        .collect();
    let mut far: Vec<f64> = boards.iter().map(|b| b.outline[0].coords.norm()).collect();
    far.sort_by(f64::total_cmp);
    let depth = far.get(far.len() / 2).copied().unwrap_or(1.0) * 0.22;
    let middle = frustum(Point3::origin(), &plane(camera, depth));
    finished(boards, middle, Vec::new())
}

fn around_board(views: &[(FrameId, Pose, String)], target: &Target, camera: &Camera) -> Scene {
    let board = outline(target);
    let size = (board[2] - board[0]).norm();
    let cameras: Vec<(Thing, Point3<f64>)> = views
        .iter()
        .map(|(id, pose, tip)| {
            let back = pose.inverse();
            let corners = plane(camera, size * 0.25).map(|p| back.apply(&p));
            let outline = corners.to_vec();
            (Thing { id: *id, outline, tip: tip.clone() }, back.apply(&Point3::origin()))
        })
        .collect();
    let tips = cameras.iter().map(|c| Some(c.1)).collect();
    let edges = board.iter().zip(board.iter().cycle().skip(1)).map(|(a, b)| [*a, *b]);
    finished(cameras.into_iter().map(|c| c.0).collect(), edges.collect(), tips)
}

fn finished(boards: Vec<Thing>, middle: Vec<[Point3<f64>; 2]>, tips: Vec<Option<Point3<f64>>>) -> Scene {
    let points: Vec<Point3<f64>> = boards
        .iter()
        .flat_map(|b| b.outline.iter().copied())
        .chain(middle.iter().flatten().copied())
        .chain(tips.iter().flatten().copied())
        .collect();
    let bound = |f: fn(f64, f64) -> f64, start: f64| {
        points.iter().fold(Vector3::repeat(start), |m, p| m.zip_map(&p.coords, f))
    };
    let (low, high) = (bound(f64::min, f64::MAX), bound(f64::max, f64::MIN));
    let center = Point3::from((low + high) / 2.0);
    let radius = points.iter().map(|p| (p - center).norm()).fold(0.0, f64::max).max(1e-9);
    let step = 10f64.powf((radius / 2.5).log10().floor());
    let floor_step =
        [5.0, 2.0, 1.0].into_iter().map(|f| f * step).find(|s| *s <= radius / 2.5).unwrap_or(step);
    Scene { boards, middle, tips, sphere: (center, radius), floor_y: high.y, floor_step, unit: "" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::action::{Action, demo};
    use crate::calib::{
        camera::Model,
        target::{BoardSize, PointSet},
    };

    #[test]
    fn the_sphere_holds_everything() {
        let target = Target::checkerboard(BoardSize { cols: 9, rows: 6 }, 25.0);
        let camera = Camera::new(Model::Pinhole, [640, 480], vec![500.0, 500.0, 320.0, 240.0]).unwrap();
        let pose = Pose::from_euler_deg([10.0, 20.0, 30.0], Vector3::new(0.0, 10.0, 600.0));
        let views = [(FrameId(0), pose, String::new())];
        let rig = (0..9u32).map(|i| {
            let [a, b, c] = [i % 3, i / 3, i * i % 5].map(f64::from);
            (i.to_string(), Point3::new(20.0 * a, 15.0 * b, 9.0 * c))
        });
        let rig = Target::Points { points: PointSet::new(rig.collect()).unwrap() };
        let scenes =
            [&target, &rig].map(|t| [around_camera(&views, t, &camera), around_board(&views, t, &camera)]);
        for scene in scenes.into_iter().flatten() {
            assert!(scene.boards.iter().all(|b| b.outline.len() == 4));
            let (center, radius) = scene.sphere;
            for p in scene.boards.iter().flat_map(|b| &b.outline).chain(scene.middle.iter().flatten()) {
                assert!((p - center).norm() <= radius * (1.0 + 1e-12));
            }
            assert!(scene.floor_step > 0.0 && scene.floor_step <= radius);
        }
        let mut state = State::default();
        state.apply(Action::Open(demo()));
        assert!(Scene::of(&state).is_none(), "no camera yet");
    }
}
