//! Markers in rendered pictures with exactly known corners.

mod render;

use nalgebra::Point3;

use super::{
    board::{AprilGrid, ArucoGrid, Charuco, Located, MarkerBoard},
    guess::guess,
    *,
};
use render::{View, white};

fn dictionary(name: &str) -> Dictionary {
    name.parse().unwrap()
}

fn charuco(columns: u32, rows: u32, legacy: bool) -> Charuco {
    let (dictionary, legacy) = (dictionary("5x5_250"), Some(legacy));
    Charuco { columns, rows, square: 1.0, marker: 0.7, dictionary, border: 1, first_id: 0, legacy }
}

fn april(columns: u32, rows: u32) -> AprilGrid {
    AprilGrid {
        columns,
        rows,
        tag: 1.0,
        spacing: 0.3,
        dictionary: dictionary("36h11"),
        border: 2,
        first_id: 0,
    }
}

fn aruco(columns: u32, rows: u32, name: &str) -> ArucoGrid {
    ArucoGrid { columns, rows, marker: 1.0, gap: 0.4, dictionary: dictionary(name), border: 1, first_id: 0 }
}

fn extent(board: &MarkerBoard) -> Vector2<f64> {
    let points = board.points();
    let far = points.iter().fold(Vector2::zeros(), |m: Vector2<f64>, p| m.sup(&p.xy().coords));
    // Inner corners begin a square inside.
    if matches!(board, MarkerBoard::Charuco(_)) { far.add_scalar(1.0) } else { far }
}

fn look(board: &MarkerBoard, view: &View) -> Sighting {
    find(&Gray::U8(view.render(white(board))))
}

/// Distances of the corners from the truth, px.
fn errors(board: &MarkerBoard, view: &View, found: &Located) -> Vec<f64> {
    let points: Vec<Point3<f64>> = board.points();
    found.corners.iter().map(|c| (view.px(points[c.index as usize].xy().coords) - c.px).norm()).collect()
}

/// These distances in standard deviations of their corners.
fn in_sigma(errors: &[f64], found: &Located) -> Vec<f64> {
    errors.iter().zip(&found.corners).map(|(e, c)| e / (c.sigma_px * 2f64.sqrt())).collect()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt()
}

/// Finds the whole board, every corner within `worst` px.
fn whole(board: &MarkerBoard, view: &View, bounds: (f64, f64), name: &str) {
    let found = board.locate(&look(board, view));
    assert_eq!(found.corners.len(), board.points().len(), "{name}: {} {:?}", found.why, found.notes);
    assert_eq!(found.inverted, view.inverted, "{name}");
    let e = errors(board, view, &found);
    let worst = e.iter().fold(0.0, |m: f64, e| m.max(*e));
    let relative = in_sigma(&e, &found);
    println!(
        "{name}: {} corners, RMS {:.4}, largest {worst:.3} px, error/σ {:.2}",
        e.len(),
        rms(&e),
        rms(&relative)
    );
    // A sharp picture without noise is better than σ says; what bends or blurs it leaves errors that no residual shows.
    assert!(rms(&relative) < 3.5, "{name}: error/σ {}", rms(&relative));
    assert!(rms(&e) < bounds.0 && worst < bounds.1, "{name}: RMS {} worst {worst}", rms(&e));
}

#[test]
fn every_dictionary_is_read_in_every_rotation() {
    for (k, d) in Dictionary::all().enumerate() {
        for (i, first_id) in [0, d.len() - 9].into_iter().enumerate() {
            let board = MarkerBoard::ArucoGrid(ArucoGrid {
                dictionary: d,
                border: 1 + (k as u8 + i as u8) % 2,
                first_id,
                ..aruco(3, 3, "4x4_50")
            });
            let turn = 90.0 * (k + 2 * i) as f64 + 7.0;
            let view = View::new([320, 320], extent(&board), 62.0, turn, 20.0);
            let found = board.locate(&look(&board, &view));
            // Some codes of the first ArUco library are the same after half a turn.
            let least = if d.name() == "original" { 20 } else { 36 };
            assert!(
                found.corners.len() >= least,
                "{d} from {first_id}: {} {}",
                found.corners.len(),
                found.why
            );
            let worst = errors(&board, &view, &found).into_iter().fold(0.0, f64::max);
            assert!(worst < 0.3, "{d}: {worst}");
        }
    }
}

#[test]
fn corners_are_exact() {
    let boards = [
        ("charuco", MarkerBoard::Charuco(charuco(7, 5, false)), (0.006, 0.02)),
        ("aprilgrid", MarkerBoard::AprilGrid(april(5, 4)), (0.006, 0.02)),
        ("arucogrid", MarkerBoard::ArucoGrid(aruco(5, 4, "6x6_250")), (0.012, 0.05)),
    ];
    for (kind, board, bounds) in boards {
        let extent = extent(&board);
        let view = |turn: f64, tilt: f64| View::new([640, 480], extent, 440.0 / extent.norm(), turn, tilt);
        for (turn, tilt) in [(3.0, 5.0), (33.0, 30.0), (100.0, 50.0), (200.0, -40.0), (290.0, 60.0)] {
            whole(&board, &view(turn, tilt), bounds, &format!("{kind} {turn} {tilt}"));
        }
        let views = [
            ("inverted", View { inverted: true, ..view(12.0, 35.0) }, 1.0),
            ("noise", View { noise: 6.0, ..view(20.0, 30.0) }, 4.0),
            ("blur", View { blur: 1.2, ..view(-20.0, 30.0) }, 2.0),
            ("dim", View { levels: [20.0, 50.0], noise: 1.0, ..view(5.0, 20.0) }, 4.0),
            ("bent", View { bend: -0.25, ..view(15.0, 25.0) }, 2.0),
        ];
        for (what, view, times) in views {
            whole(&board, &view, (bounds.0 * times, bounds.1 * times), &format!("{kind} {what}"));
        }
    }
}

#[test]
fn both_layouts_of_charuco_are_told_apart() {
    for (legacy, rows) in [(false, 6), (true, 6), (false, 5)] {
        let board = charuco(6, rows, legacy);
        let view = View::new([640, 480], Vector2::new(6.0, f64::from(rows)), 60.0, 10.0, 30.0);
        let sighting = look(&MarkerBoard::Charuco(board), &view);
        let found = Charuco { legacy: None, ..board }.locate(&sighting);
        assert_eq!(found.corners.len(), board.points().len(), "{}", found.why);
        assert!(errors(&MarkerBoard::Charuco(board), &view, &found).iter().all(|e| *e < 0.2));
        assert_eq!(found.notes.len(), usize::from(legacy));
        // The wrong one finds nothing false.
        let wrong = Charuco { legacy: Some(!legacy), ..board }.locate(&sighting);
        assert!(rows == 5 || (wrong.corners.is_empty() && wrong.why.contains("layout")), "{wrong:?}");
    }
}

#[test]
fn mirrored_prints_are_named() {
    let board = MarkerBoard::Charuco(charuco(6, 5, false));
    let view = View::new([640, 480], Vector2::new(6.0, 5.0), 70.0, 10.0, 20.0);
    let picture = view.render(white(&board));
    let mirrored = Plane::from_fn(640, 480, |x, y| picture.at(639 - x, y));
    let found = board.locate(&find(&Gray::U8(mirrored)));
    assert!(found.corners.is_empty() && found.why.contains("mirrored"), "{}", found.why);
    // A wrong border and a wrong dictionary are told too.
    let sighting = find(&Gray::U8(picture));
    let other = |b: Charuco| MarkerBoard::Charuco(b).locate(&sighting).why;
    let why = other(Charuco { border: 2, ..charuco(6, 5, false) });
    assert!(why.contains("border of 1"), "{why}");
    let why = other(Charuco { dictionary: dictionary("6x6_50"), ..charuco(6, 5, false) });
    assert!(why.contains("dictionary"), "{why}");
    let why = other(Charuco { first_id: 100, ..charuco(6, 5, false) });
    assert!(why.contains("ids 100"), "{why}");
}

#[test]
fn hidden_corners_are_missing_not_wrong() {
    for board in [
        MarkerBoard::Charuco(charuco(8, 6, false)),
        MarkerBoard::AprilGrid(april(5, 4)),
        MarkerBoard::ArucoGrid(aruco(5, 4, "4x4_50")),
    ] {
        let e = extent(&board);
        let view = View::new([640, 480], e, 440.0 / e.norm(), 25.0, 30.0);
        let mut picture = view.render(white(&board));
        for (x, y) in (200..330).flat_map(|y| (270..380).map(move |x| (x, y))) {
            picture.row_mut(y)[x] = 120;
        }
        let found = board.locate(&find(&Gray::U8(picture)));
        let all = board.points().len();
        assert!(found.corners.len() < all && found.corners.len() > all / 2, "{}", found.corners.len());
        let worst = errors(&board, &view, &found).into_iter().fold(0.0, f64::max);
        println!("{}: {} of {all}, largest {worst:.3}", board.kind(), found.corners.len());
        assert!(worst < 0.8, "{} {worst}", board.kind());
    }
}

#[test]
fn of_two_boards_the_larger_part_is_used_and_it_is_said() {
    let board = MarkerBoard::AprilGrid(april(4, 3));
    let view = View::new([640, 480], extent(&board), 55.0, 0.0, 20.0);
    let one = view.render(white(&board));
    // Beside it the same once more, its right part cut off.
    let both = Plane::from_fn(900, 480, |x, y| if x < 600 { one.at(x, y) } else { one.at(x - 500, y) });
    let found = board.locate(&find(&Gray::U8(both)));
    assert_eq!(found.corners.len(), 48);
    assert!(errors(&board, &view, &found).iter().all(|e| *e < 0.2));
    assert!(found.notes.iter().any(|n| n.contains("two boards")), "{:?}", found.notes);
}

#[test]
fn small_and_large_markers() {
    // Twelve pixels a marker.
    let small = MarkerBoard::ArucoGrid(aruco(6, 5, "4x4_50"));
    let view = View { noise: 1.0, ..View::new([320, 240], extent(&small), 12.0, 9.0, 0.0) };
    let found = small.locate(&look(&small, &view));
    println!("12 px: {} of 30 markers", found.markers);
    assert!(found.markers >= 28, "{}", found.markers);
    // One that fills a picture of 24 megapixels, out of focus.
    let large = MarkerBoard::ArucoGrid(aruco(1, 1, "36h11"));
    let view = View { blur: 3.0, ..View::new([6000, 4000], Vector2::new(1.0, 1.0), 2500.0, 20.0, 20.0) };
    whole(&large, &view, (0.3, 0.5), "2500 px");
}

#[test]
fn deep_and_odd_pictures() {
    let board = MarkerBoard::Charuco(charuco(6, 5, false));
    let view = View::new([640, 480], Vector2::new(6.0, 5.0), 70.0, 10.0, 20.0);
    let picture = view.render(white(&board));
    let deep = Gray::U16(picture.map(|v| 300 + 16 * u16::from(v)));
    let found = board.locate(&find(&deep));
    assert_eq!(found.corners.len(), 20, "{}", found.why);
    assert!(errors(&board, &view, &found).iter().all(|e| *e < 0.12));
    for (w, h) in [(0, 0), (1, 1), (1, 3000), (3000, 1), (9, 9), (25, 24), (64, 5)] {
        let striped = Plane::from_fn(w, h, |x, y| if (x / 4 + y / 5) % 2 == 0 { 20 } else { 220 });
        assert!(find(&Gray::U8(striped)).marks.is_empty());
    }
    assert!(find(&Gray::U16(Plane::new(0, 0))).marks.is_empty());
}

#[test]
fn boards_are_guessed_from_their_markers() {
    let boards = [
        MarkerBoard::Charuco(charuco(7, 5, false)),
        MarkerBoard::Charuco(charuco(6, 6, true)),
        MarkerBoard::Charuco(charuco(6, 4, false)),
        MarkerBoard::AprilGrid(april(5, 4)),
        MarkerBoard::ArucoGrid(ArucoGrid { gap: 0.2, ..aruco(5, 4, "6x6_250") }),
    ];
    for board in boards {
        let e = extent(&board);
        let views = [(0.0, 10.0), (70.0, 30.0), (160.0, -40.0)];
        let sightings: Vec<Sighting> = views
            .iter()
            .map(|(turn, tilt)| look(&board, &View::new([640, 480], e, 440.0 / e.norm(), *turn, *tilt)))
            .collect();
        let found = guess(&sightings);
        println!("{found:?}");
        let (Some(a), b) = (found.board, board) else { panic!("{board:?}: {:?}", found.considered) };
        assert!(found.certain, "{:?}", found.considered);
        match (a, b) {
            (MarkerBoard::Charuco(a), MarkerBoard::Charuco(b)) => {
                // What the pictures cannot tell: which of the dictionaries with the same codes, and the layout of odd rows.
                assert_eq!(Charuco { dictionary: b.dictionary, legacy: b.legacy, ..a }, b);
                assert_eq!(a.layout(a.legacy == Some(true)).marks, b.layout(b.legacy == Some(true)).marks);
            }
            (MarkerBoard::AprilGrid(a), MarkerBoard::AprilGrid(b)) => assert_eq!(a, b),
            (MarkerBoard::ArucoGrid(a), MarkerBoard::ArucoGrid(b)) => {
                assert_eq!(ArucoGrid { dictionary: b.dictionary, ..a }, b);
            }
            _ => panic!("{a:?} instead of {b:?}"),
        }
    }
    assert!(guess(&[]).board.is_none());
    assert!(!guess(&[Sighting::default()]).considered.is_empty());
}

/// Markers of 24 px, cells of 4: σ is what corners are off by, whatever the noise.
#[test]
fn the_sigma_of_small_markers_is_true() {
    let board = MarkerBoard::ArucoGrid(aruco(5, 4, "4x4_50"));
    let e = extent(&board);
    for noise in [0.5, 2.0, 6.0, 15.0, 25.0] {
        for (turn, tilt) in [(20.0, 30.0), (45.0, 10.0)] {
            let view = View { noise, ..View::new([400, 300], e, 270.0 / e.norm(), turn, tilt) };
            let found = board.locate(&look(&board, &view));
            let errors = errors(&board, &view, &found);
            let off = rms(&in_sigma(&errors, &found));
            println!("noise {noise}, turned by {turn}: RMS {:.4} px, error/σ {off:.2}", rms(&errors));
            assert!(errors.len() == 80 && (0.8..1.6).contains(&off), "noise {noise}: {off}");
        }
    }
}
