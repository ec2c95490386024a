//! Whether a report is what its own observations give: its numbers beside those of a second solution, one by one.

use serde::Serialize;

use super::{
    camera::refit::grid,
    report::{FrameReport, Report, Solution},
    residual::{Field, ResidualMap},
};

/// Largest difference of a number `p`, in units of max(|p|, 1).
pub const TOLERANCE: f64 = 1e-9;

/// Columns and rows of the places at which residual maps are compared.
const PLACES: [u32; 2] = [20, 15];

/// Numbers of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    /// What they are.
    pub name: &'static str,
    /// How many were compared.
    pub numbers: usize,
    /// How many differ by more than [`TOLERANCE`].
    pub differ: usize,
    /// The one that differs most; none where there are no numbers.
    pub worst: Option<Difference>,
}

/// A number of the file beside that of the solution.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Which: `fx`, `left03.jpg tvec[2]`, …
    pub name: String,
    /// In the file.
    pub held: f64,
    /// Solved again.
    pub solved: f64,
    /// |Δ| / max(|p|, 1); infinite where one of the two is no number.
    pub relative: f64,
}

/// What a second solution says about a report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Version of the program that wrote the report.
    pub written_by: String,
    /// Version of this one.
    pub checked_by: &'static str,
    /// Pictures that were used.
    pub pictures: usize,
    /// Corners in them.
    pub corners: usize,
    /// Pictures that only one of the two solutions used.
    pub used_by_one: Vec<String>,
    /// The numbers by kind.
    pub parts: Vec<Part>,
    /// Whether the words of a page are those that its numbers give; none where the file is no page, or of another version.
    pub page_as_written: Option<bool>,
    /// Whether everything agrees.
    pub agrees: bool,
}

impl Check {
    /// The number that differs most of all.
    pub fn worst(&self) -> Option<&Difference> {
        let all = self.parts.iter().filter_map(|p| p.worst.as_ref());
        all.max_by(|a, b| a.relative.total_cmp(&b.relative))
    }

    /// How many numbers were compared.
    pub fn numbers(&self) -> usize {
        self.parts.iter().map(|p| p.numbers).sum()
    }
}

impl Part {
    const fn new(name: &'static str) -> Self {
        Self { name, numbers: 0, differ: 0, worst: None }
    }

    fn add(&mut self, name: impl Fn() -> String, held: f64, solved: f64) {
        let relative = (held - solved).abs() / held.abs().max(solved.abs()).max(1.0);
        // Two infinities that are equal do not differ.
        let relative = if held.to_bits() == solved.to_bits() { 0.0 } else { relative };
        let relative = if relative.is_nan() { f64::INFINITY } else { relative };
        self.numbers += 1;
        self.differ += usize::from(relative > TOLERANCE);
        if self.worst.as_ref().is_none_or(|w| relative > w.relative) {
            self.worst = Some(Difference { name: name(), held, solved, relative });
        }
    }

    /// Numbers in a list; what only one of the two has counts as different.
    fn list(&mut self, name: impl Fn(usize) -> String, held: &[f64], solved: &[f64]) {
        for i in 0..held.len().max(solved.len()) {
            let at = |list: &[f64]| list.get(i).copied().unwrap_or(f64::NAN);
            self.add(|| name(i), at(held), at(solved));
        }
    }
}

/// Compares a report with what its observations gave when they were solved again.
pub fn compare(held: &Report, solved: &Report, page_as_written: Option<bool>) -> Check {
    let mut parts = Vec::new();
    if let (Some(a), Some(b)) = (&held.solution, &solved.solution) {
        parts.extend(of_camera(a, b));
    }
    let mut poses = Part::new("poses");
    let mut residuals = Part::new("residuals");
    let mut used_by_one = Vec::new();
    for (a, b) in held.frames.iter().zip(&solved.frames) {
        if a.included != b.included {
            used_by_one.push(a.file.clone());
        } else if a.included {
            of_picture(a, b, &mut poses, &mut residuals);
        }
    }
    parts.extend([poses, residuals]);
    let solvable = held.solution.is_some() && solved.solution.is_some();
    let agrees = solvable
        && used_by_one.is_empty()
        && page_as_written != Some(false)
        && parts.iter().all(|p| p.differ == 0);
    Check {
        written_by: held.version.clone(),
        checked_by: env!("CARGO_PKG_VERSION"),
        pictures: held.included().count(),
        corners: held.included().map(|f| f.corners.len()).sum(),
        used_by_one,
        parts,
        page_as_written,
        agrees,
    }
}

fn of_camera(a: &Solution, b: &Solution) -> Vec<Part> {
    let params = a.camera.spec().params;
    let name = |i: usize| params.get(i).map_or_else(|| i.to_string(), |p| p.name.to_owned());
    let mut intrinsics = Part::new("intrinsics");
    if a.camera.model == b.camera.model {
        intrinsics.list(name, &a.camera.params, &b.camera.params);
    } else {
        intrinsics.add(|| "model".to_owned(), f64::NAN, f64::NAN);
    }
    let mut rms = Part::new("RMS");
    let of = |s: &Solution| [s.rms_px, s.rms_per_coordinate_px, s.rms_inliers_px, s.sigma0_px];
    let names = ["rms_px", "rms_per_coordinate_px", "rms_inliers_px", "sigma0_px"];
    rms.list(|i| names.get(i).copied().unwrap_or_default().to_owned(), &of(a), &of(b));
    let mut sigma = Part::new("σ and covariance");
    // A parameter that was fixed has none, in both.
    let of = |s: &Solution| s.sigma.iter().map(|(_, v)| v.unwrap_or(-1.0)).collect::<Vec<_>>();
    sigma.list(|i| format!("sigma {}", name(i)), &of(a), &of(b));
    let rows = a.covariance.nrows().max(1);
    sigma.list(
        |i| format!("covariance {} {}", name(i % rows), name(i / rows)),
        a.covariance.as_slice(),
        b.covariance.as_slice(),
    );
    let mut parts = vec![intrinsics, rms, sigma];
    if let (Some(x), Some(y)) = (&a.residual_map, &b.residual_map) {
        let mut map = Part::new("residual map");
        let held_out = |m: &ResidualMap| [m.held_out.without_px, m.held_out.with_px];
        map.list(|i| format!("held_out[{i}]"), &held_out(x), &held_out(y));
        let places: Vec<_> = grid(a.camera.size_px, PLACES).collect();
        let moved = |m: &ResidualMap| {
            let of = |f: &Field| places.iter().flat_map(|px| <[f64; 2]>::from(f.at(px))).collect();
            m.field.as_ref().map_or(Vec::new(), of)
        };
        map.list(|i| format!("at ({:.0}, {:.0})", places[i / 2].x, places[i / 2].y), &moved(x), &moved(y));
        parts.push(map);
    }
    parts
}

fn of_picture(a: &FrameReport, b: &FrameReport, poses: &mut Part, residuals: &mut Part) {
    let field = |what: &'static str| move |i: usize| format!("{} {what}[{i}]", a.name());
    let list = |v: Option<[f64; 3]>| v.map_or(Vec::new(), |v| v.to_vec());
    poses.list(field("rvec_rad"), &list(a.rvec_rad), &list(b.rvec_rad));
    poses.list(field("tvec"), &list(a.tvec), &list(b.tvec));
    // Files of older versions have none.
    if let (Some(a), Some(b)) = (&a.pose_covariance, &b.pose_covariance) {
        poses.list(field("pose_covariance"), a.pose.as_flattened(), b.pose.as_flattened());
        poses.list(field("pose_covariance with the camera"), &a.camera.concat(), &b.camera.concat());
    }
    residuals.list(field("residuals_px"), &a.residuals_px.concat(), &b.residuals_px.concat());
    let figures = |f: &FrameReport| {
        let some = [f.rms_px, f.max_px, f.tilt_rad, f.roll_rad, f.distance].map(|v| v.unwrap_or(f64::NAN));
        let mut all = some.to_vec();
        all.extend(f.outliers.iter().map(|i| f64::from(*i)));
        all
    };
    let names = ["rms_px", "max_px", "tilt_rad", "roll_rad", "distance"];
    let name = |i: usize| format!("{} {}", a.name(), names.get(i).copied().unwrap_or("outliers"));
    residuals.list(name, &figures(a), &figures(b));
}
