//! A script that can be run.

use std::fmt::Write as _;

use crate::calib::camera::Camera;

/// Straightens one picture with OpenCV. Numbers are written so that they read back exactly.
pub(super) fn python(camera: &Camera) -> String {
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px;
    let terms = ["k1", "k2", "p1", "p2", "k3"].map(|name| format!("{:?}", camera.get(name).unwrap_or(0.0)));
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = write!(
        text,
        "import sys\n\nimport cv2\nimport numpy as np\n\n# {model}, {w} x {h} px; the centre of the first pixel is (0, 0)\n\
         camera_matrix = np.array([[{fx:?}, 0.0, {cx:?}], [0.0, {fy:?}, {cy:?}], [0.0, 0.0, 1.0]])\n\
         dist_coeffs = np.array([{terms}])  # k1 k2 p1 p2 k3\n\n\
         picture = cv2.imread(sys.argv[1])\nassert picture.shape[1::-1] == ({w}, {h}), picture.shape\n\
         cv2.imwrite(\"straight.png\", cv2.undistort(picture, camera_matrix, dist_coeffs))\n",
        model = camera.spec().title,
        terms = terms.join(", "),
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::camera::Model;

    #[test]
    fn the_numbers_read_back() {
        let params =
            vec![533.123_456_789_012_3, 1.0 / 3.0 * 1600.0, 319.5, 239.5, -0.281, 1e-17, 0.0, 2e-4, 0.1];
        let camera = Camera::new(Model::Brown5, [640, 480], params.clone()).unwrap();
        let text = python(&camera);
        let number = |s: &str| s.trim_matches(['[', ']', ' ']).parse::<f64>().ok();
        let found: Vec<f64> = text.split([',', '(', ')', ' ']).filter_map(number).collect();
        for value in params {
            assert!(found.contains(&value), "{value}");
        }
    }
}
