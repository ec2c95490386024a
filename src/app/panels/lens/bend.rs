//! How far rows and columns of a board are from straight.

use nalgebra::Vector2;

use crate::{
    app::state::State,
    calib::{camera::Camera, observation::Corner, target::BoardSize},
};

/// Largest distance of a corner from the line through the ends of its row or column: in the selected picture, and after the lens
/// was taken out; px.
pub(super) fn of_selected(state: &State) -> Option<[f64; 2]> {
    let (answer, solution) = state.data.solved()?;
    let frame = answer.frame(state.selected()?).filter(|f| f.included)?;
    let board = answer.report().settings.board?;
    Some([worst(&frame.corners, board), worst(&straightened(&frame.corners, &solution.camera), board)])
}

/// Corners where a camera with the same focal lengths and centre but without distortion would show them.
fn straightened(corners: &[Corner], camera: &Camera) -> Vec<Corner> {
    let [fx, fy, cx, cy] = camera.intrinsics();
    let one = |c: &Corner| {
        let ray = camera.unproject(&c.px).filter(|r| r.z > 1e-6)?;
        Some(Corner { px: Vector2::new(fx * ray.x / ray.z + cx, fy * ray.y / ray.z + cy), ..*c })
    };
    corners.iter().filter_map(one).collect()
}

fn worst(corners: &[Corner], board: BoardSize) -> f64 {
    let mut most = 0.0f64;
    for along in 0..2 {
        let lines = if along == 0 { board.rows } else { board.cols };
        for line in 0..lines {
            let on: Vec<Vector2<f64>> =
                corners.iter().filter(|c| board.at(c.index)[1 - along] == line).map(|c| c.px).collect();
            let (Some(first), Some(last)) = (on.first(), on.last()) else { continue };
            let d = last - first;
            if on.len() >= 3 && d.norm() > 0.0 {
                most = on.iter().map(|p| (p - first).perp(&d).abs() / d.norm()).fold(most, f64::max);
            }
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::camera::Model;
    use nalgebra::Point3;

    const BOARD: BoardSize = BoardSize { cols: 9, rows: 6 };

    fn seen(camera: &Camera) -> Vec<Corner> {
        let corner = |index: u32| {
            let [x, y] = BOARD.at(index).map(f64::from);
            let px = camera.project(&Point3::new((x - 4.0) * 0.1, (y - 2.5) * 0.1, 1.0)).unwrap();
            Corner { index, px, sigma_px: 0.0 }
        };
        (0..BOARD.len() as u32).map(corner).collect()
    }

    #[test]
    fn straight_rows_do_not_bend_and_barrel_does() {
        let pinhole = Camera::new(Model::Pinhole, [640, 480], vec![500.0, 500.0, 320.0, 240.0]).unwrap();
        assert!(worst(&seen(&pinhole), BOARD) < 1e-9);
        let mut params = vec![500.0, 500.0, 320.0, 240.0, -0.2, 0.0, 0.0, 0.0, 0.0];
        let barrel = Camera::new(Model::Brown5, [640, 480], params.clone()).unwrap();
        // The outer row at y = 0.25: its middle stays at 0.25·(1 + k·0.0625), its ends at 0.25·(1 + k·(0.0625 + 0.16)).
        let sagitta = 500.0 * 0.25 * 0.2 * 0.16;
        let bend = worst(&seen(&barrel), BOARD);
        assert!((bend - sagitta).abs() < 0.5, "{bend} {sagitta}");
        assert!(worst(&straightened(&seen(&barrel), &barrel), BOARD) < 1e-6);
        params[4] = 0.2;
        let pincushion = Camera::new(Model::Brown5, [640, 480], params).unwrap();
        assert!((worst(&seen(&pincushion), BOARD) - sagitta).abs() < 0.5);
    }
}
