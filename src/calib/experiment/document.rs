//! What the source document says: its own figures, to be measured against. Sections are the document's.

/// Names of the parameters, in the order of [`ESTIMATE`].
pub const PARAMETERS: [&str; 9] = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];
/// Eq. 5 and 6.
pub const ESTIMATE: [f64; 9] =
    [999.8720, 999.9510, 400.2130, 299.8870, -0.27963, 0.09981, 0.00098, 0.00201, 0.00003];
/// Decimals of [`ESTIMATE`].
pub const DECIMALS: [usize; 9] = [4, 4, 4, 4, 5, 5, 5, 5, 5];

/// Table IV, px: overall RMS.
pub const RMS_PX: f64 = 0.4832;
/// Mean.
pub const MEAN_PX: f64 = 0.4651;
/// Median.
pub const MEDIAN_PX: f64 = 0.4489;
/// Largest.
pub const MAX_PX: f64 = 0.8213;
/// Smallest.
pub const MIN_PX: f64 = 0.1027;
/// Standard deviation.
pub const STD_PX: f64 = 0.1438;
/// 95th percentile.
pub const P95_PX: f64 = 0.7204;

/// V-E: mean error of view 1, the smallest, px.
pub const VIEW_1_PX: f64 = 0.38;
/// V-E: mean error of view 10, the largest, px.
pub const VIEW_10_PX: f64 = 0.61;
/// VI-A: by how much views 10 and 11 exceed the frontal view, px.
pub const TILT_EXCESS_PX: f64 = 0.2;

/// V-B: pictures and corners.
pub const PICTURES: usize = 15;
/// V-B.
pub const CORNERS: usize = 810;

/// V-F: share of width and height that the corners span, %.
pub const COVERAGE_PERCENT: [f64; 2] = [92.0, 88.0];
/// V-G: largest displacement, px.
pub const DISPLACEMENT_PX: f64 = 18.0;
/// V-G: the same, % of the diagonal.
pub const DISPLACEMENT_PERCENT: f64 = 3.0;

/// V-C: relative error of the focal lengths, %.
pub const FOCAL_PERCENT: f64 = 0.013;
/// V-C: error of the principal point, px.
pub const CENTER_PX: f64 = 0.213;
/// V-C: error of k1.
pub const K1_ERROR: f64 = 3.7e-4;
/// V-C: relative errors of p1 and p2, %.
pub const TANGENTIAL_PERCENT: [f64; 2] = [2.0, 0.5];

/// VI-A: angle that a pixel sees, degrees.
pub const PIXEL_DEG: f64 = 0.06;
/// VI-A: best precision of a corner, px.
pub const PRECISION_PX: [f64; 2] = [0.1, 0.2];
/// VII: by what `cornerSubPix` divides the error.
pub const REFINEMENT_GAIN: f64 = 10.0;
/// III-C, IV-B: largest tilt, largest roll; VI-B: smallest tilt that it advises, degrees.
pub const POSES_DEG: [f64; 3] = [25.0, 30.0, 15.0];
