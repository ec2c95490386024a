//! Square markers in photographs: skipped where they are not there.

use straightedge::calib::marker::{
    Sighting,
    board::{AprilGrid, ArucoGrid, Charuco, MarkerBoard},
    dictionary::Dictionary,
    find,
    guess::guess,
};

use crate::detection::pictures;

fn dictionary(name: &str) -> Dictionary {
    name.parse().unwrap()
}

fn charuco(columns: u32, rows: u32) -> Charuco {
    let dictionary = dictionary("5x5_250");
    Charuco { columns, rows, square: 1.0, marker: 0.7, dictionary, border: 1, first_id: 0, legacy: None }
}

fn april(columns: u32, rows: u32) -> AprilGrid {
    let dictionary = dictionary("36h11");
    AprilGrid { columns, rows, tag: 1.0, spacing: 0.3, dictionary, border: 2, first_id: 0 }
}

fn aruco(columns: u32, rows: u32) -> ArucoGrid {
    let dictionary = dictionary("4x4_50");
    ArucoGrid { columns, rows, marker: 1.0, gap: 0.4, dictionary, border: 1, first_id: 0 }
}

#[test]
fn every_tag_of_the_aprilgrids_is_found() {
    let board = AprilGrid { tag: 0.088, ..april(6, 6) };
    for (name, picture) in pictures("aprilgrid_tumvi_euroc") {
        let found = board.locate(&find(&picture));
        assert_eq!(
            (found.markers, found.corners.len()),
            (36, 144),
            "{name}: {} {:?}",
            found.why,
            found.notes
        );
    }
}

/// Corners that OpenCV 5.0.0 finds (`CharucoDetector`, inverted markers looked for).
const OPENCV: [(&str, usize); 15] = [
    ("cam0_0066.jpg", 12),
    ("cam0_0072.jpg", 12),
    ("cam0_0078.jpg", 12),
    ("cam0_0084.jpg", 12),
    ("cam0_0090.jpg", 12),
    ("cam0_0096.jpg", 12),
    ("cam0_0102.jpg", 12),
    ("cam0_0108.jpg", 12),
    ("cam1_0018.jpg", 1),
    ("cam1_0078.jpg", 4),
    ("cam1_0084.jpg", 5),
    ("cam1_0090.jpg", 12),
    ("cam1_0096.jpg", 12),
    ("cam1_0102.jpg", 12),
    ("cam1_0108.jpg", 12),
];

#[test]
fn the_charuco_board_is_found_at_least_where_opencv_finds_it_and_guessed() {
    let pictures = pictures("caliscope_charuco");
    if pictures.is_empty() {
        return;
    }
    let sightings: Vec<Sighting> = pictures.iter().map(|(_, p)| find(p)).collect();
    let found = guess(&sightings);
    let Some(MarkerBoard::Charuco(board)) = found.board else { panic!("{found:?}") };
    assert!(found.certain && (board.columns, board.rows) == (4, 5) && (board.marker - 0.75).abs() < 1e-9);
    for ((name, _), sighting) in pictures.iter().zip(&sightings) {
        let located = board.locate(sighting);
        let least = OPENCV.iter().find(|o| o.0 == name).map_or(0, |o| o.1);
        assert!(located.corners.len() >= least, "{name}: {} {}", located.corners.len(), located.why);
        assert!(located.corners.is_empty() || located.inverted, "{name}");
    }
}

#[test]
fn no_marker_is_invented() {
    let sets =
        ["negatives", "opencv_left", "opencv_right", "udacity_lane", "caliscope_chess", "plantcv_gopro"];
    let more = [
        "learning_opencv_phone",
        "camodocal_fisheye",
        "opencv_chess_misc",
        "opencv_circles",
        "opencv_acircles",
    ];
    let (mut marks, mut alone) = (0, 0);
    for set in sets.iter().chain(&more) {
        let pictures = pictures(set);
        let sightings: Vec<Sighting> = pictures.iter().map(|(_, p)| find(p)).collect();
        assert!(guess(&sightings).board.is_none(), "{set}");
        for ((name, _), sighting) in pictures.iter().zip(&sightings) {
            marks += sighting.marks.len();
            for d in Dictionary::all() {
                alone += sighting.marks.iter().filter(|m| m.identify(d).is_some()).count();
                for border in [1, 2] {
                    let boards = [
                        MarkerBoard::Charuco(Charuco { dictionary: d, border, ..charuco(10, 10) }),
                        MarkerBoard::AprilGrid(AprilGrid { dictionary: d, border, ..april(10, 10) }),
                        MarkerBoard::ArucoGrid(ArucoGrid { dictionary: d, border, ..aruco(30, 30) }),
                    ];
                    for board in boards {
                        let found = board.locate(sighting);
                        assert!(found.corners.is_empty(), "{set}/{name}: {board:?} {found:?}");
                    }
                }
            }
        }
    }
    println!("{marks} marks, {alone} of them with an id by chance, none of them on a board");
}
