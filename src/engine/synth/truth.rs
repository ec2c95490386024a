//! The truth file that lies beside synthetic pictures, read and written.

use nalgebra::Vector2;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::{
    Error, Result,
    camera::{Camera, Model},
    named::Named,
    pose::Pose,
    target::{BoardSize, Target, Unit},
};

/// True camera, board, poses and corners of a set of pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// The camera.
    #[serde(with = "camera")]
    pub camera: Camera,
    /// Inner corners.
    #[serde(with = "board_size")]
    pub board: BoardSize,
    /// Edge of a square.
    pub square: f64,
    /// Unit of the square and of the translations.
    pub unit: Unit,
    /// The pictures.
    pub frames: Vec<TruthFrame>,
}

/// Truth of one picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "WireFrame", into = "WireFrame")]
pub struct TruthFrame {
    /// File name of the picture.
    pub file: String,
    /// `camera_from_board`, the board frame at corner 0.
    pub pose: Pose,
    /// `(index, x, y)` of the corners that lie inside the picture, px.
    pub corners: Vec<(u32, f64, f64)>,
}

/// With the fields of the pose beside the others.
#[derive(Serialize, Deserialize)]
struct WireFrame {
    file: String,
    rvec_rad: [f64; 3],
    tvec: [f64; 3],
    corners: Vec<(u32, f64, f64)>,
}

impl From<WireFrame> for TruthFrame {
    fn from(wire: WireFrame) -> Self {
        let pose = Pose::from_rvec_tvec(wire.rvec_rad.into(), wire.tvec.into());
        Self { file: wire.file, pose, corners: wire.corners }
    }
}

impl From<TruthFrame> for WireFrame {
    fn from(frame: TruthFrame) -> Self {
        let pose = frame.pose;
        Self {
            file: frame.file,
            rvec_rad: pose.rvec().into(),
            tvec: pose.translation.into(),
            corners: frame.corners,
        }
    }
}

impl Truth {
    /// Reads a truth file.
    ///
    /// # Errors
    /// [`Error::Format`] with the place and what was expected; [`Error::Invalid`] where the camera is refused.
    pub fn from_json(text: &str) -> Result<Self> {
        let truth: Self = crate::json::read(text).map_err(|e| Error::format("truth file", e.to_string()))?;
        truth.camera.validate()?;
        Ok(truth)
    }

    /// Writes a truth file.
    pub fn to_json(&self) -> String {
        crate::json::text(self)
    }

    /// The board as a target.
    pub const fn target(&self) -> Target {
        Target::checkerboard(self.board, self.square)
    }

    /// The frame of a picture, by file name without its folders.
    pub fn frame(&self, file: &str) -> Option<&TruthFrame> {
        let wanted = file_name(file);
        self.frames.iter().find(|f| file_name(&f.file) == wanted)
    }
}

fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

impl TruthFrame {
    /// True place of a corner, px.
    pub fn corner_px(&self, index: u32) -> Option<Vector2<f64>> {
        self.corners.iter().find(|c| c.0 == index).map(|c| Vector2::new(c.1, c.2))
    }
}

/// A board size as text, `9x6`.
pub mod board_size {
    use super::{BoardSize, Deserialize, Deserializer, Serializer, de};

    /// Writes `9x6`.
    ///
    /// # Errors
    /// The serializer's.
    pub fn serialize<S: Serializer>(size: &BoardSize, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(size)
    }

    /// Reads `9x6`.
    ///
    /// # Errors
    /// Where the text is not a board size.
    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<BoardSize, D::Error> {
        String::deserialize(d)?.parse().map_err(de::Error::custom)
    }
}

/// A camera as `{model, size_px, camera_matrix {fx, …}, distortion {k1, …}}`.
pub mod camera {
    use super::{Camera, Deserialize, Deserializer, Model, Named, Serialize, Serializer, de};

    #[derive(Serialize, Deserialize)]
    struct Wire {
        model: Model,
        size_px: [u32; 2],
        camera_matrix: Named<f64>,
        #[serde(default)]
        distortion: Named<f64>,
    }

    /// Writes named parameters in the model's order.
    ///
    /// # Errors
    /// The serializer's.
    pub fn serialize<S: Serializer>(camera: &Camera, s: S) -> Result<S::Ok, S::Error> {
        let all = camera.spec().params.iter().zip(&camera.params).map(|(p, v)| (p.name.to_owned(), *v));
        let (matrix, rest): (Vec<_>, Vec<_>) = all.enumerate().partition(|(i, _)| *i < 4);
        let named = |list: Vec<(usize, (String, f64))>| Named(list.into_iter().map(|(_, nv)| nv).collect());
        let (model, size_px) = (camera.model, camera.size_px);
        Wire { model, size_px, camera_matrix: named(matrix), distortion: named(rest) }.serialize(s)
    }

    /// Reads named parameters in any order; those that are not named are zero.
    ///
    /// # Errors
    /// Where a name is unknown or a number is refused.
    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Camera, D::Error> {
        let w = Wire::deserialize(d)?;
        let named: Vec<(&str, f64)> =
            w.camera_matrix.0.iter().chain(&w.distortion.0).map(|(n, v)| (n.as_str(), *v)).collect();
        Camera::from_named(w.model, w.size_px, &named).map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Scene;

    #[test]
    fn truth_files_survive_writing_and_reading() {
        let truth = Scene::seed().truth();
        let text = truth.to_json();
        let back = Truth::from_json(&text).unwrap();
        assert_eq!((back.frames.len(), back.camera.clone(), back.board), (15, truth.camera, truth.board));
        for (a, b) in truth.frames.iter().zip(&back.frames) {
            assert_eq!((&a.file, &a.corners), (&b.file, &b.corners));
            assert!((a.pose.matrix() - b.pose.matrix()).norm() < 1e-14);
        }
        assert!(back.frame("some/folder/view_03.png").is_some_and(|f| f.corner_px(53).is_some()));
    }

    #[test]
    fn the_fields_are_those_of_the_interface() {
        let json: serde_json::Value = serde_json::from_str(&Scene::seed().truth().to_json()).unwrap();
        assert_eq!(
            (&json["board"], &json["unit"], &json["square"]),
            (&"9x6".into(), &"mm".into(), &30.0.into())
        );
        assert_eq!(json["camera"]["model"], "brown5");
        assert_eq!(json["camera"]["size_px"], serde_json::json!([800, 600]));
        assert_eq!(json["camera"]["camera_matrix"]["fx"], 1000.0);
        assert_eq!(json["camera"]["distortion"]["k1"], -0.28);
        let frame = &json["frames"][0];
        assert_eq!(frame["file"], "view_01.png");
        assert_eq!(frame["rvec_rad"], serde_json::json!([0.0, 0.0, 0.0]));
        assert_eq!(frame["tvec"], serde_json::json!([-120.0, -75.0, 600.0]));
        assert_eq!(frame["corners"].as_array().map(Vec::len), Some(54));
        assert_eq!(frame["corners"][7][0], 7);
    }

    #[test]
    fn wrong_files_name_what_is_wrong() {
        let text = Scene::seed().truth().to_json();
        for (from, to, say) in [
            ("\"9x6\"", "\"nine\"", "board size"),
            ("\"fx\": 1000.0", "\"fx\": -1.0", "fx"),
            ("\"k1\"", "\"q1\"", "q1"),
            ("\"frames\"", "\"pictures\"", "frames"),
        ] {
            let error = Truth::from_json(&text.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(error.contains(say), "{error}");
        }
        assert!(Truth::from_json("").is_err());
    }
}
