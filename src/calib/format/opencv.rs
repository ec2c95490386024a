//! `OpenCV` `FileStorage`: YAML as the calibration sample writes it.
//!
//! Read are YAML 1.0 (`OpenCV` 4) and 1.2 (`OpenCV` 5), the XML and JSON twins, and the names of the interactive
//! calibration and of the older tutorial. Origin at the centre of the first pixel; `k1 k2 p1 p2 k3 …`.

use std::fmt::Write as _;

use nalgebra::{Vector2, Vector3};
use roxmltree::{Document, Node as Xml};

use super::{
    Content, Draft, Evidence, Export, Format, Frame,
    lens::{self, held, opencv_terms},
    node::{Node, size_px},
    number::{array, joined, number},
};
use crate::calib::{
    Error, Result,
    camera::Model,
    observation::Corner,
    pose::Pose,
    target::{BoardSize, Unit},
};

pub(super) const FORMAT: Format = Format {
    name: "opencv",
    title: "OpenCV YAML",
    extensions: &["yaml", "yml"],
    usual: &["yaml", "yml", "xml", "json"],
    stem: "camera",
    convention: "Pixels as OpenCV counts them: the centre of the first is (0, 0). Terms in the order k1 k2 p1 p2 k3, then k4 k5 k6, s1 to s4, τx τy; of a fisheye k1 k2 k3 k4.",
    lacks: "double sphere and EUCM (refitted)",
    write,
    read,
    sniff: |t| {
        t.contains("opencv-matrix")
            || t.contains("<opencv_storage>")
            || ["cameraMatrix:", "Camera_Matrix:"].iter().any(|k| t.contains(k))
    },
};

/// What OpenCV has, and what stands for the rest.
const HAS: &[Model] = &[Model::Brown5, Model::Rational, Model::ThinPrism, Model::Tilted, Model::Kb4];
const OTHERWISE: &[Model] = &[Model::Rational, Model::Kb4];

fn matrix(out: &mut String, name: &str, rows: usize, cols: usize, kind: &str, data: &[f64]) {
    let _ = write!(
        out,
        "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: {kind}\n   data: [ {} ]\n",
        joined(data, ", ")
    );
}

/// A double-quoted YAML string; control characters become blanks.
pub(super) fn quoted(text: &str) -> String {
    let clean: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!("\"{}\"", clean.replace('\\', "\\\\").replace('"', "\\\""))
}

fn write(export: &Export<'_>) -> Result<Draft> {
    let evidence = export.evidence;
    let (camera, note) = held(export.camera, HAS, OTHERWISE, "OpenCV")?;
    // Kannala–Brandt, by the name that its samples give it.
    let is_fisheye = camera.model == Model::Kb4;
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px;
    let views: Vec<&Frame> = evidence.frames.iter().filter(|f| f.camera_from_board.is_some()).collect();
    let mut out = String::from("%YAML:1.0\n---\n");
    if let Some(date) = &evidence.date {
        let _ = writeln!(out, "calibration_time: {}", quoted(date));
    }
    if !views.is_empty() {
        let _ = writeln!(out, "nframes: {}", views.len());
    }
    let _ = write!(out, "image_width: {w}\nimage_height: {h}\n");
    if let Some(board) = evidence.board {
        let _ = write!(out, "board_width: {}\nboard_height: {}\n", board.cols, board.rows);
    }
    if let Some(square) = evidence.square {
        let _ = writeln!(out, "square_size: {}", number(square));
    }
    out += "flags: 0\n";
    if is_fisheye {
        out += "fisheye_model: 1\n";
    }
    matrix(&mut out, "camera_matrix", 3, 3, "d", &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    let terms = opencv_terms(&camera).unwrap_or_else(|| camera.params[4..].to_vec());
    matrix(&mut out, "distortion_coefficients", terms.len(), 1, "d", &terms);
    if let Some(rms) = evidence.rms_px {
        let _ = writeln!(out, "avg_reprojection_error: {}", number(rms));
    }
    write_views(&mut out, evidence, &views);
    Ok(Draft::noted(out, note))
}

fn write_views(out: &mut String, evidence: &Evidence, views: &[&Frame]) {
    let n = views.len();
    if n == 0 {
        return;
    }
    let errors: Option<Vec<f64>> = views.iter().map(|f| f.rms_px).collect();
    if let Some(errors) = errors {
        matrix(out, "per_view_reprojection_errors", n, 1, "d", &errors);
    }
    let poses: Vec<f64> = views
        .iter()
        .filter_map(|f| f.camera_from_board)
        .flat_map(|p| p.rvec().iter().chain(p.translation.iter()).copied().collect::<Vec<_>>())
        .collect();
    matrix(out, "extrinsic_parameters", n, 6, "d", &poses);
    let files: Vec<String> = views.iter().map(|f| format!("   - {}\n", quoted(&f.file))).collect();
    let _ = write!(out, "image_files:\n{}", files.concat());
    // The sample's matrix of corners has no place for a missing one.
    let full = evidence.board.map_or(0, BoardSize::len);
    if full > 0 && views.iter().all(|f| f.corners.len() == full) {
        let corners: Vec<f64> =
            views.iter().flat_map(|f| &f.corners).flat_map(|c| [c.px.x, c.px.y]).collect();
        matrix(out, "image_points", n, full, "\"2d\"", &corners);
    }
}

fn read(text: &str) -> Result<Content> {
    let trimmed = text.trim_start();
    let root = if trimmed.starts_with('<') {
        xml_root(trimmed)?
    } else if trimmed.starts_with('{') {
        Node::from_json(trimmed)?
    } else {
        Node::from_yaml(trimmed)?
    };
    let fisheye = root.number_or_zero("fisheye_model")? != 0.0;
    let (name, k) = root
        .find_any(&["camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M1", "cameraMatrix1"])
        .ok_or_else(|| Error::Invalid("the field camera_matrix is missing".to_owned()))?;
    let intrinsics = camera_matrix(name, &elements(name, k)?)?;
    let coefficients = match root.find_any(&[
        "distortion_coefficients",
        "dist_coeffs",
        "Distortion_Coefficients",
        "distCoeffs",
        "D",
        "D1",
        "distCoeffs1",
    ]) {
        Some((name, d)) => elements(name, d)?,
        None => return Err(Error::Invalid("the field distortion_coefficients is missing".to_owned())),
    };
    let size = picture_size(&root)?;
    let read = if fisheye { lens::fisheye } else { lens::opencv };
    let camera = read(size, intrinsics, &coefficients)?;
    Ok(Content { evidence: evidence(&root)?, ..camera.into() })
}

/// `fx fy cx cy` of a row-major 3 × 3 matrix.
pub(super) fn camera_matrix(name: &str, k: &[f64]) -> Result<[f64; 4]> {
    let Some([fx, skew, cx, zero, fy, cy, p, q, one]) = array::<9>(k) else {
        return Err(Error::Invalid(format!("{name} has {} numbers, 9 (3 x 3) are expected", k.len())));
    };
    if [zero, p, q] != [0.0; 3] || one != 1.0 {
        return Err(Error::Invalid(format!("{name} is not of the form [fx 0 cx; 0 fy cy; 0 0 1]")));
    }
    if skew != 0.0 {
        return Err(Error::Unsupported(format!(
            "{name} has a skew of {skew}: OpenCV and what follows it have none, so it is not clear what is meant"
        )));
    }
    Ok([fx, fy, cx, cy])
}

/// The numbers of an `opencv-matrix`, or of a plain list.
fn elements(name: &str, node: &Node) -> Result<Vec<f64>> {
    let Some(data) = node.find("data") else {
        return if matches!(node, Node::Map(_)) {
            Err(Error::Invalid(format!("{name} has no data")))
        } else {
            node.numbers(name)
        };
    };
    let values = data.numbers(name)?;
    if let (Some(rows), Some(cols)) = (node.find("rows"), node.find("cols")) {
        let cells = rows.number(name)? * cols.number(name)?;
        let channels: f64 = match node.text_at("dt") {
            // "2d" = two channels of doubles; XML keeps the quotes.
            Some(t) => t.trim_matches(|c: char| c.is_alphabetic() || c == '"').parse().unwrap_or(1.0),
            None => 1.0,
        };
        if cells * channels != values.len() as f64 {
            return Err(Error::Invalid(format!(
                "{name} has {} numbers, its rows and columns say {}: the file is damaged",
                values.len(),
                cells * channels
            )));
        }
    }
    Ok(values)
}

fn picture_size(root: &Node) -> Result<[u32; 2]> {
    let pair = |w: &str, h: &str| match (root.find(w), root.find(h)) {
        (Some(a), Some(b)) => Ok(Some(size_px(a.number(w)?, b.number(h)?)?)),
        _ => Ok(None),
    };
    let list = |name: &str| match root.find(name) {
        Some(n) => match elements(name, n)?.as_slice() {
            [w, h] => size_px(*w, *h).map(Some),
            other => Err(Error::Invalid(format!("{name} has {} numbers, 2 are expected", other.len()))),
        },
        None => Ok(None),
    };
    let found: Vec<[u32; 2]> = [
        pair("image_width", "image_height")?,
        pair("image_Width", "image_Height")?,
        list("cameraResolution")?,
        list("image_size")?,
        list("imageSize")?,
    ]
    .into_iter()
    .flatten()
    .collect();
    match found.as_slice() {
        [] => Err(Error::Invalid(
            "the picture size is missing: add the lines image_width: … and image_height: …".to_owned(),
        )),
        [first, rest @ ..] => match rest.iter().find(|s| *s != first) {
            Some(other) => Err(Error::Invalid(format!(
                "two picture sizes contradict each other: {}x{} and {}x{}",
                first[0], first[1], other[0], other[1]
            ))),
            None => Ok(*first),
        },
    }
}

fn evidence(root: &Node) -> Result<Evidence> {
    let mut evidence = Evidence {
        date: root.text_at("calibration_time").or_else(|| root.text_at("calibrationDate")).map(str::to_owned),
        square: root.find("square_size").map(|v| v.number("square_size")).transpose()?.filter(|v| *v > 0.0),
        ..Evidence::default()
    };
    if evidence.square.is_some() {
        evidence.unit = Some(Unit::Unspecified);
    }
    if let (Some(c), Some(r)) = (root.find("board_width"), root.find("board_height")) {
        evidence.board = format!("{}x{}", c.number("board_width")?, r.number("board_height")?).parse().ok();
    }
    if let Some((name, rms)) = root.find_any(&["avg_reprojection_error", "Avg_Reprojection_Error"]) {
        evidence.rms_px = Some(rms.number(name)?);
    }
    let list = |names: &[&str]| match root.find_any(names) {
        Some((name, node)) => elements(name, node),
        None => Ok(Vec::new()),
    };
    let poses = list(&["extrinsic_parameters", "Extrinsic_Parameters"])?;
    let errors = list(&["per_view_reprojection_errors", "Per_View_Reprojection_Errors"])?;
    let points = list(&["image_points", "Image_points"])?;
    let files = root.find("image_files").map_or(&[][..], Node::items);
    let n = poses.len() / 6;
    let per_view = points.len().checked_div(n).unwrap_or(0);
    for (i, pose) in poses.chunks_exact(6).enumerate() {
        let [r, t] = [0, 3].map(|k| Vector3::new(pose[k], pose[k + 1], pose[k + 2]));
        let corners = points.chunks_exact(per_view.max(1)).nth(i).unwrap_or(&[]).chunks_exact(2).enumerate();
        evidence.frames.push(Frame {
            file: match files.get(i) {
                Some(Node::Text(name)) => name.clone(),
                _ => format!("view {}", i + 1),
            },
            camera_from_board: Some(Pose::from_rvec_tvec(r, t)),
            rms_px: errors.get(i).copied(),
            corners: corners
                .map(|(k, p)| Corner { index: k as u32, px: Vector2::new(p[0], p[1]), sigma_px: 0.0 })
                .collect(),
        });
    }
    Ok(evidence)
}

fn xml_root(text: &str) -> Result<Node> {
    let document = Document::parse(text).map_err(|e| Error::Invalid(format!("not valid XML: {e}")))?;
    Ok(xml_node(document.root_element()))
}

/// `opencv_storage` as a tree: elements with children are maps, others text; matrices are two levels deep.
fn xml_node(element: Xml<'_, '_>) -> Node {
    let child = |e: Xml<'_, '_>| {
        let fields: Vec<(String, Node)> = e
            .children()
            .filter(Xml::is_element)
            .map(|c| (c.tag_name().name().to_owned(), Node::Text(c.text().unwrap_or("").trim().to_owned())))
            .collect();
        if fields.is_empty() {
            Node::Text(e.text().unwrap_or("").trim().to_owned())
        } else {
            Node::Map(fields)
        }
    };
    Node::Map(
        element
            .children()
            .filter(Xml::is_element)
            .map(|e| (e.tag_name().name().to_owned(), child(e)))
            .collect(),
    )
}
