//! Photographs: skipped where they are not there.

use std::path::{Path, PathBuf};

use super::*;
use crate::job::photo::{self, Colours};

/// The folder of a set; a printed line and `None` where it is absent.
fn data(set: &str) -> Option<PathBuf> {
    let root = std::env::var_os("STRAIGHTEDGE_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let folder = root.join(set);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no photographs in {} (set STRAIGHTEDGE_DATA)", folder.display());
    None
}

fn read(path: &Path) -> Gray {
    photo::read(path, Colours::Gray).unwrap().photo.into_gray()
}

fn pictures(set: &str) -> Vec<(String, Gray)> {
    let Some(folder) = data(set) else { return Vec::new() };
    let paths = photo::list(&[folder]).unwrap();
    paths.iter().map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), read(p))).collect()
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
                        MarkerBoard::Charuco(Charuco {
                            legacy: None,
                            dictionary: d,
                            border,
                            ..charuco(10, 10, false)
                        }),
                        MarkerBoard::AprilGrid(AprilGrid { dictionary: d, border, ..april(10, 10) }),
                        MarkerBoard::ArucoGrid(ArucoGrid {
                            dictionary: d,
                            border,
                            ..aruco(30, 30, "4x4_50")
                        }),
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
