//! nerfstudio `transforms.json` (also read by instant-ngp).
//!
//! The top-left *corner* of the picture is (0, 0). Documented terms of `OPENCV` are `k1 k2 p1 p2`: k3 is refitted away
//! (nerfstudio itself would read it, other readers of the file ignore it). Poses are camera-to-world with OpenGL's axes
//! (y up, z backwards); the world is the board.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::Serialize;

use super::{
    Content, Draft, Evidence, Export, Format, Frame,
    lens::{self, held, moved},
    node::{Node, size_px},
    number::{joined, number},
};
use crate::calib::{Error, Result, camera::Model, pose::Pose};

pub(super) const FORMAT: Format = Format {
    name: "nerfstudio",
    title: "nerfstudio transforms.json",
    extensions: &[],
    usual: &["json"],
    stem: "camera",
    convention: "The corner of the first pixel is (0, 0): cx and cy are half a pixel larger than OpenCV's. OPENCV with k1 k2 p1 p2, OPENCV_FISHEYE with k1 k2 k3 k4, by name.",
    lacks: "k3 and what follows it (refitted), sigmas",
    write,
    read,
    sniff: |t| {
        t.trim_start().starts_with('{') && (t.contains("\"fl_x\"") || t.contains("\"camera_angle_x\""))
    },
};

/// Offset of its principal point from ours, px.
const ORIGIN: f64 = 0.5;
/// Relative difference of two focal lengths that is no contradiction: angles are written rounded, and without distortion.
const ANGLE_TOLERANCE: f64 = 0.01;

fn write(export: &Export<'_>) -> Result<Draft> {
    let models = &[Model::Brown4, Model::Kb4];
    let (camera, note) = held(export.camera, models, models, "nerfstudio")?;
    let p = &camera.params;
    let (model, names) = match camera.model {
        Model::Kb4 => ("OPENCV_FISHEYE", ["k1", "k2", "k3", "k4"]),
        _ => ("OPENCV", ["k1", "k2", "p1", "p2"]),
    };
    let [fx, fy, cx, cy] = moved([p[0], p[1], p[2], p[3]], ORIGIN);
    let [w, h] = camera.size_px;
    let fields = [("fl_x", fx), ("fl_y", fy), ("cx", cx), ("cy", cy)]
        .map(|(n, v)| format!("  \"{n}\": {},\n", number(v)))
        .concat();
    let terms = names.iter().zip(&p[4..]).map(|(n, v)| format!("  \"{n}\": {},\n", number(*v)));
    let frames: Vec<String> = export.evidence.frames.iter().filter_map(frame).collect();
    let frames =
        if frames.is_empty() { "[]".to_owned() } else { format!("[\n    {}\n  ]", frames.join(",\n    ")) };
    let text = format!(
        "{{\n  \"camera_model\": \"{model}\",\n{fields}  \"w\": {w},\n  \"h\": {h},\n{}  \"frames\": {frames}\n}}\n",
        terms.collect::<String>()
    );
    Ok(Draft::noted(text, note))
}

/// A picture with its pose; `None` where the pose is unknown.
fn frame(frame: &Frame) -> Option<String> {
    #[derive(Serialize)]
    struct Name<'a>(&'a str);
    let world_from_camera = frame.camera_from_board?.inverse();
    let (r, t) = (world_from_camera.matrix(), world_from_camera.translation);
    let rows: Vec<String> = (0..3)
        .map(|i| format!("[{}]", joined(&[r[(i, 0)], 0.0 - r[(i, 1)], 0.0 - r[(i, 2)], t[i]], ", ")))
        .collect();
    let file = serde_json::to_string(&Name(&frame.file)).ok()?;
    Some(format!(
        "{{\"file_path\": {file}, \"transform_matrix\": [{}, [0.0, 0.0, 0.0, 1.0]]}}",
        rows.join(", ")
    ))
}

fn read(text: &str) -> Result<Content> {
    let root = Node::from_json(text)?;
    let frames = root.find("frames").map_or(&[][..], Node::items);
    let mut notes = Vec::new();
    let has_focal = |n: &Node| n.find("fl_x").is_some() || n.find("camera_angle_x").is_some();
    let fields = if has_focal(&root) {
        &root
    } else {
        let first = frames
            .iter()
            .find(|f| has_focal(f))
            .ok_or_else(|| Error::Invalid("the field fl_x is missing".to_owned()))?;
        if frames.len() > 1 {
            notes.push("each picture has its own camera: that of the first one is used".to_owned());
        }
        first
    };
    let fisheye = match root.text_at("camera_model").or_else(|| fields.text_at("camera_model")) {
        None | Some("OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "RADIAL" | "SIMPLE_RADIAL" | "FULL_OPENCV") => {
            false
        }
        Some("OPENCV_FISHEYE") => true,
        Some(other) => {
            return Err(Error::Unsupported(format!(
                "camera_model {other} is not supported yet: only OPENCV and OPENCV_FISHEYE are"
            )));
        }
    };
    let field = |name: &str| fields.find(name).or_else(|| root.find(name));
    let required = |name: &str| {
        field(name).ok_or_else(|| Error::Invalid(format!("the field {name} is missing")))?.number(name)
    };
    let (w, h) = (required("w")?, required("h")?);
    let size = size_px(w, h)?;
    let mut focal = |fl: &str, angle: &str, extent: f64| -> Result<Option<f64>> {
        let given = field(fl).map(|v| v.number(fl)).transpose()?;
        let of_angle = |a: &Node| Ok(extent / (2.0 * (a.number(angle)? / 2.0).tan()));
        let by_angle = field(angle).map(of_angle).transpose()?;
        if let (Some(fl_px), Some(angle_px)) = (given, by_angle)
            && (fl_px - angle_px).abs() > ANGLE_TOLERANCE * fl_px.abs()
        {
            notes.push(format!(
                "{angle} means a focal length of {angle_px:.1} px, {fl} says {fl_px:.1} px: {fl} is used"
            ));
        }
        Ok(given.or(by_angle))
    };
    let fx = focal("fl_x", "camera_angle_x", w)?
        .ok_or_else(|| Error::Invalid("the field fl_x is missing".to_owned()))?;
    let fy = focal("fl_y", "camera_angle_y", h)?.unwrap_or(fx);
    let or = |name: &str, default: f64| field(name).map_or(Ok(default), |v| v.number(name));
    let k = moved([fx, fy, or("cx", w / 2.0)?, or("cy", h / 2.0)?], -ORIGIN);
    // nerfstudio's k4 is a fourth power of r² in the numerator, not OpenCV's k4.
    let d = [or("k1", 0.0)?, or("k2", 0.0)?, or("p1", 0.0)?, or("p2", 0.0)?, or("k3", 0.0)?, or("k4", 0.0)?];
    let camera = if fisheye {
        lens::fisheye(size, k, &[d[0], d[1], d[4], d[5]])?
    } else if d[5] == 0.0 {
        lens::opencv(size, k, &d[..5])?
    } else {
        return Err(Error::Unsupported(format!(
            "k4 = {}: a fourth radial term of this kind has no camera model here",
            d[5]
        )));
    };
    let evidence =
        Evidence { frames: frames.iter().map(read_frame).collect::<Result<_>>()?, ..Evidence::default() };
    Ok(Content { camera, evidence, notes })
}

fn read_frame(node: &Node) -> Result<Frame> {
    let mut frame =
        Frame { file: node.text_at("file_path").unwrap_or_default().to_owned(), ..Frame::default() };
    if node.find("transform_matrix").is_some() {
        let m: [f64; 16] = node.array_at("transform_matrix")?;
        let r = Matrix3::new(m[0], -m[1], -m[2], m[4], -m[5], -m[6], m[8], -m[9], -m[10]);
        if (r * r.transpose() - Matrix3::identity()).norm() > 1e-3 || r.determinant() < 0.0 {
            return Err(Error::Invalid(format!(
                "transform_matrix of \"{}\" is not a rigid motion",
                frame.file
            )));
        }
        let world_from_camera = Pose {
            rotation: Rotation3::from_matrix_unchecked(r),
            translation: Vector3::new(m[3], m[7], m[11]),
        };
        frame.camera_from_board = Some(world_from_camera.inverse());
    }
    Ok(frame)
}
