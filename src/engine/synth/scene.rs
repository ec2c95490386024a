//! What is in front of the camera: board, poses, levels; the source document's scene.

use nalgebra::{Point3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{Degrade, Truth, TruthFrame, surface::Surface};
use crate::{
    Error, Result,
    camera::{Camera, Model},
    pose::Pose,
    target::{BoardSize, Target, Unit},
};

/// Most pixels that a rendered picture may have.
const MAX_PIXELS: u64 = 200_000_000;

/// A camera in front of a checkerboard, view by view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The true camera.
    pub camera: Camera,
    /// The board.
    pub board: Board,
    /// Where the board is in each view.
    pub poses: Vec<ScenePose>,
    /// How it is drawn.
    #[serde(default)]
    pub method: Method,
    /// What spoils the pictures.
    #[serde(default)]
    pub degrade: Degrade,
    /// Seed of everything random.
    #[serde(default)]
    pub seed: u64,
    /// Whether pictures are written with three equal channels instead of one.
    #[serde(default)]
    pub color: bool,
}

/// The checkerboard and its surroundings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Inner corners; there is one more square each way.
    #[serde(with = "super::truth::board_size")]
    pub size: BoardSize,
    /// Edge of a square.
    pub square: f64,
    /// Unit of the square, of the poses and of the bend.
    #[serde(default = "millimetres")]
    pub unit: Unit,
    /// Width of the white border around the squares, in squares.
    #[serde(default)]
    pub margin: f64,
    /// Grey values.
    #[serde(default)]
    pub levels: Levels,
    /// Which point of the board the poses place.
    #[serde(default)]
    pub origin: Origin,
}

const fn millimetres() -> Unit {
    Unit::Mm
}

/// Grey values of a scene, 0..=255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Levels {
    /// Black squares.
    pub black: u8,
    /// White squares and margin.
    pub white: u8,
    /// Everything beside the board.
    pub background: u8,
}

impl Default for Levels {
    fn default() -> Self {
        Self { black: 0, white: 255, background: 160 }
    }
}

/// Which point of the board a scene's poses place in front of the camera. Truth is always about corner 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The first inner corner, as the source document's text says.
    #[default]
    FirstInner,
    /// The outer corner of the first square, which is what its Table II fits.
    Outer,
}

/// How a scene is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Mean over each pixel's area, by inverse mapping.
    #[default]
    Exact,
    /// A polygon per square with vertices on whole pixels, as the source document's `cv2.fillPoly`.
    Crude(Cut),
}

/// How [`Method::Crude`] takes vertices to whole pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cut {
    /// Towards zero: `astype(int)`.
    #[default]
    Truncate,
    /// To the nearest.
    Round,
}

/// A pose as the source document writes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenePose {
    /// `[αx, αy, αz]`, degrees; `R = Rz · Ry · Rx`.
    pub angles_deg: [f64; 3],
    /// Place of the board's origin in the camera frame, in the board's unit.
    pub translation: [f64; 3],
    /// A few words for people.
    #[serde(default)]
    pub description: String,
}

/// Refuses a camera whose pictures cannot be drawn.
///
/// # Errors
/// [`Error::Invalid`] from [`Camera::validate`], and where they are too large.
pub(super) fn check_camera(camera: &Camera) -> Result<()> {
    camera.validate()?;
    let [w, h] = camera.size_px;
    if u64::from(w) * u64::from(h) > MAX_PIXELS {
        return Err(Error::Invalid(format!(
            "a picture of {w} x {h} px is too large: at most 200 megapixels"
        )));
    }
    Ok(())
}

impl Board {
    /// The squares' inner corners as a target.
    pub const fn target(&self) -> Target {
        Target::checkerboard(self.size, self.square)
    }

    /// Corner 0 in the frame that the poses place.
    pub fn corner0_in_origin(&self) -> Vector3<f64> {
        match self.origin {
            Origin::FirstInner => Vector3::zeros(),
            Origin::Outer => Vector3::new(self.square, self.square, 0.0),
        }
    }

    /// Smallest and largest board coordinate of the printed board (margin included) along x and y, from corner 0, in
    /// squares.
    pub fn extent_squares(&self) -> [[f64; 2]; 2] {
        let ends = |corners: u32| [-1.0 - self.margin, f64::from(corners) + self.margin];
        [ends(self.size.cols), ends(self.size.rows)]
    }
}

/// Tables I and II of the source document: angles in degrees, translation in millimetres, description.
const TABLE_II: [([f64; 3], [f64; 3], &str); 15] = [
    ([0.0, 0.0, 0.0], [-150.0, -105.0, 600.0], "Frontal, centered"),
    ([20.0, 0.0, 0.0], [-140.0, -125.0, 600.0], "Tilt forward"),
    ([-20.0, 0.0, 0.0], [-160.0, -85.0, 600.0], "Tilt backward"),
    ([0.0, 25.0, 0.0], [-180.0, -105.0, 600.0], "Rotate left"),
    ([0.0, -25.0, 0.0], [-120.0, -105.0, 600.0], "Rotate right"),
    ([15.0, 20.0, 0.0], [-170.0, -115.0, 580.0], "Mixed tilt 1"),
    ([-15.0, -20.0, 0.0], [-130.0, -95.0, 620.0], "Mixed tilt 2"),
    ([10.0, 10.0, 10.0], [-150.0, -105.0, 560.0], "Diagonal rotation"),
    ([-10.0, -10.0, -10.0], [-150.0, -105.0, 640.0], "Diagonal opposite"),
    ([25.0, 10.0, 5.0], [-160.0, -120.0, 600.0], "Large tilt"),
    ([-5.0, 30.0, 0.0], [-190.0, -100.0, 580.0], "Wide horizontal rotation"),
    ([5.0, -30.0, 0.0], [-110.0, -110.0, 580.0], "Wide horizontal opposite"),
    ([20.0, -15.0, 5.0], [-135.0, -125.0, 600.0], "Complex pose 1"),
    ([-20.0, 15.0, -5.0], [-165.0, -85.0, 600.0], "Complex pose 2"),
    ([0.0, 0.0, 15.0], [-150.0, -105.0, 550.0], "In-plane rotation"),
];

impl Scene {
    /// The source document's scene: Table I's camera (800 × 600 px, k1 −0.28), Table II's 15 poses, 9 × 6 inner corners
    /// of 30 mm painted straight onto grey 160. The origin is the outer corner, the only one that centres its boards.
    pub fn seed() -> Self {
        let params = vec![1000.0, 1000.0, 400.0, 300.0, -0.28, 0.10, 0.001, 0.002, 0.0];
        let pose = |&(angles_deg, translation, description): &([f64; 3], [f64; 3], &str)| ScenePose {
            angles_deg,
            translation,
            description: description.to_owned(),
        };
        Self {
            camera: Camera { model: Model::Brown5, size_px: [800, 600], params },
            board: Board {
                size: BoardSize { cols: 9, rows: 6 },
                square: 30.0,
                unit: Unit::Mm,
                margin: 0.0,
                levels: Levels::default(),
                origin: Origin::Outer,
            },
            poses: TABLE_II.iter().map(pose).collect(),
            method: Method::Exact,
            degrade: Degrade::default(),
            seed: 0,
            color: true,
        }
    }

    /// Gives all lengths in another unit: what the camera sees stays. Where one of the units is no length of the world, the
    /// numbers stay.
    pub fn measure_in(&mut self, unit: Unit) {
        if let (Some(from), Some(to)) = (self.board.unit.metres(), unit.metres()) {
            let convert = |length: &mut f64| *length = *length * from / to;
            convert(&mut self.board.square);
            convert(&mut self.degrade.bend);
            self.poses.iter_mut().flat_map(|p| &mut p.translation).for_each(convert);
        }
        self.board.unit = unit;
    }

    /// Reads a scene file: this type as JSON.
    ///
    /// # Errors
    /// [`Error::Format`] with the place and what was expected; [`Error::Invalid`] from [`Scene::validate`].
    pub fn from_json(text: &str) -> Result<Self> {
        let scene: Self = crate::json::read(text).map_err(|e| Error::format("scene file", e.to_string()))?;
        scene.validate()?;
        Ok(scene)
    }

    /// The scene as [`Scene::from_json`] reads it.
    pub fn to_json(&self) -> String {
        crate::json::text(self)
    }

    /// `camera_from_board` of a view with the board frame at corner 0, or `None` where there is no such view.
    pub fn camera_from_board(&self, view: usize) -> Option<Pose> {
        let p = self.poses.get(view)?;
        let placed = Pose::from_euler_deg(p.angles_deg, p.translation.into());
        let translation = placed.translation + placed.rotation * self.board.corner0_in_origin();
        Some(Pose { translation, ..placed })
    }

    /// True places of all corners of a view, by index, px; `None` where the camera cannot see the point at all.
    /// Corners may lie outside the picture.
    pub fn corners_px(&self, view: usize) -> Vec<Option<Vector2<f64>>> {
        let Some(pose) = self.camera_from_board(view) else { return Vec::new() };
        let surface = Surface::new(&self.board, self.degrade.bend);
        let points = self.board.target().points_in_board();
        points.iter().map(|p| self.camera.project(&pose.apply(&surface.lift(p.x, p.y)))).collect()
    }

    /// Name of a view's picture.
    pub fn file_name(&self, view: usize) -> String {
        let digits = self.poses.len().to_string().len().max(2);
        format!("view_{:0digits$}.png", view + 1)
    }

    /// The truth file: camera, poses about corner 0, and the corners that lie inside each picture.
    pub fn truth(&self) -> Truth {
        let [w, h] = self.camera.size_px.map(f64::from);
        let inside = |p: &Vector2<f64>| p.x >= -0.5 && p.x <= w - 0.5 && p.y >= -0.5 && p.y <= h - 0.5;
        let frames = (0..self.poses.len()).filter_map(|view| {
            let corners = self.corners_px(view).into_iter().enumerate();
            let corners = corners.filter_map(|(i, p)| p.filter(inside).map(|p| (i as u32, p.x, p.y)));
            Some(TruthFrame {
                file: self.file_name(view),
                pose: self.camera_from_board(view)?,
                corners: corners.collect(),
            })
        });
        Truth {
            camera: self.camera.clone(),
            board: self.board.size,
            square: self.board.square,
            unit: self.board.unit,
            frames: frames.collect(),
        }
    }

    /// Checks that every view can be drawn.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the view and the number that is wrong: not finite, not positive, a board behind the
    /// camera or one that shows its back.
    pub fn validate(&self) -> Result<()> {
        check_camera(&self.camera)?;
        let b = &self.board;
        if b.size.cols < 2 || b.size.rows < 2 || b.size.cols > 500 || b.size.rows > 500 {
            return Err(Error::Invalid(format!(
                "a board of {} inner corners: each side from 2 to 500",
                b.size
            )));
        }
        if !(b.square.is_finite() && b.square > 0.0) {
            return Err(Error::Invalid(format!("a square of {}: it must be greater than zero", b.square)));
        }
        if !(b.margin.is_finite() && (0.0..=100.0).contains(&b.margin)) {
            return Err(Error::Invalid(format!("a margin of {} squares: give 0 to 100", b.margin)));
        }
        self.degrade.validate()?;
        let width = f64::from(b.size.cols + 1) * b.square;
        if self.degrade.bend.abs() > width / 2.0 {
            return Err(Error::Invalid(format!(
                "a bend of {} over a board {width} wide: at most half the width",
                self.degrade.bend
            )));
        }
        (0..self.poses.len()).try_for_each(|view| self.validate_view(view))
    }

    fn validate_view(&self, view: usize) -> Result<()> {
        let wrong = |what: &str| Err(Error::Invalid(format!("view {}: {what}", view + 1)));
        let Some(pose) = self.camera_from_board(view) else {
            return wrong("the scene has no such view");
        };
        let p = &self.poses[view];
        if !p.angles_deg.iter().chain(&p.translation).all(|v| v.is_finite()) {
            return wrong("angles and translation must be finite numbers");
        }
        let surface = Surface::new(&self.board, self.degrade.bend);
        let [x_ends, y_ends] = self.board.extent_squares();
        for x in x_ends {
            for y in y_ends {
                let point = pose.apply(&surface.lift(x * self.board.square, y * self.board.square));
                if point.z <= 1e-6 * self.board.square {
                    return wrong("the board reaches behind the camera: move it to a larger z");
                }
            }
        }
        // The camera must be on the side of the board that z points away from.
        let camera_in_board = pose.inverse().apply(&Point3::origin());
        if camera_in_board.z >= 0.0 {
            return wrong("the board shows its back: keep it turned by less than 90°");
        }
        Ok(())
    }
}
