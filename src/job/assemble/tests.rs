use nalgebra::Vector2;

use super::*;
use crate::calib::{
    detect::GridCorner,
    image::{Gray, Plane},
    marker::{Sighting, dictionary::Dictionary, find},
};

/// A whole board of `size` seen from the front at `at`, corner 0 touching a black square.
fn grid(size: [u32; 2], at: f64) -> Grid {
    let cells = (0..size[1]).flat_map(|row| (0..size[0]).map(move |col| [col, row]));
    let corner = |cell: [u32; 2]| GridCorner {
        cell,
        px: Vector2::new(at + 20.0 * f64::from(cell[0]), at + 20.0 * f64::from(cell[1])),
        sigma_px: 0.05,
    };
    Grid { size, corners: cells.map(corner).collect(), black_first: true, ends: [true; 4], dots: Vec::new() }
}

fn entry(file: &str, size_px: [u32; 2], grid: Option<Grid>, hash: u128) -> Entry {
    let why = if grid.is_some() { String::new() } else { "no corners: sharper pictures".to_owned() };
    let finding = Finding::Grid(Detection { grid, why, passed_over: false, light: None });
    let seen = Seen {
        size_px,
        exif: Exif::default(),
        pixels_hash: Some(hash),
        notes: Vec::new(),
        finding,
        other: Other::default(),
    };
    Entry { file: file.to_owned(), seen: Ok(seen) }
}

fn wanted(board: Option<&str>) -> Wanted {
    Wanted {
        board: board.map(|b| b.parse().unwrap()),
        target: None,
        square: 25.0,
        model: Model::Brown5,
        start: None,
        options: Options::default(),
    }
}

/// Three pictures of a 9x6 board, one without, one unreadable.
fn set() -> Vec<Entry> {
    let board = |i: u128| {
        let shift = i as f64;
        entry(&format!("p/{i}.png"), [640, 480], Some(grid([9, 6], 50.0 + shift)), i)
    };
    let broken = Entry { file: "p/broken.png".to_owned(), seen: Err("cut short".to_owned()) };
    vec![board(0), board(1), entry("p/none.png", [640, 480], None, 10), board(2), broken]
}

fn codes(assembly: &Assembly) -> Vec<&str> {
    assembly.warnings.iter().map(|w| w.code.as_str()).collect()
}

#[test]
fn the_board_is_found_or_given() {
    for board in [None, Some("9x6")] {
        let a = assemble(&set(), &wanted(board));
        let problem = a.problem.as_ref().unwrap();
        assert_eq!(a.target.as_ref().and_then(Target::grid), "9x6".parse().ok());
        assert_eq!(problem.observations.iter().map(|o| o.frame.0).collect::<Vec<_>>(), [0, 1, 3]);
        assert_eq!((problem.cameras[0].size_px, problem.observations[0].corners.len()), ([640, 480], 54));
        let states: Vec<_> = a.frames.iter().map(|f| f.state.name()).collect();
        assert_eq!(states, ["full", "full", "none", "full", "unreadable"]);
        assert_eq!(
            (a.frames[2].why.as_str(), a.frames[4].why.as_str()),
            ("no corners: sharper pictures", "cut short")
        );
        assert_eq!(codes(&a), ["unreadable"]);
    }
    let a = assemble(&set(), &wanted(Some("8x6")));
    assert_eq!(a.frames[0].why, "found 9x6, asked 8x6");
    let Err(Error::NoBoard(text)) = &a.problem else { panic!("{:?}", a.problem) };
    assert!(text.contains("found 9x6, asked 8x6 in 3 of 5") && text.contains("--board 9x6"), "{text}");
}

#[test]
fn the_group_with_the_most_boards_is_calibrated() {
    let mut entries = set();
    // More pictures at another size, fewer boards.
    entries.extend((20..28).map(|i| entry(&format!("p/{i}.png"), [800, 600], None, i)));
    entries.push(entry("p/28.png", [800, 600], Some(grid([9, 6], 90.0)), 28));
    entries.push(entry("p/29.png", [800, 600], Some(grid([7, 5], 90.0)), 29));
    let a = assemble(&entries, &wanted(None));
    assert_eq!(a.problem.as_ref().unwrap().observations.len(), 3);
    assert_eq!((a.groups[0].images, a.groups[0].found, a.groups[1].found), (4, 3, 1));
    assert_eq!(a.frames[13].why, "not calibrated: 800x600 px, not 640x480");
    assert_eq!(a.frames[14].why, "found 7x5, asked 9x6");
    let about = a.warnings.iter().find(|w| w.code == "other_camera").unwrap();
    assert_eq!(about.frames, ["p/28.png"]);
    assert!(a.frames.iter().all(|f| !f.included));
}

#[test]
fn copies_count_once() {
    let mut entries = set();
    entries.push(entry("p/again.png", [640, 480], Some(grid([9, 6], 51.0)), 1));
    let a = assemble(&entries, &wanted(None));
    assert_eq!(a.problem.as_ref().unwrap().observations.len(), 3);
    assert_eq!(
        (a.frames[5].copy_of.as_deref(), a.frames[5].why.as_str()),
        (Some("p/1.png"), "a copy of 1.png")
    );
    assert_eq!(codes(&a), ["unreadable", "copies"]);
}

#[test]
fn corners_of_a_file_need_no_pixels() {
    let corners: Vec<Corner> = grid([4, 3], 10.0)
        .corners
        .iter()
        .enumerate()
        .map(|(i, c)| Corner { index: i as u32, px: c.px, sigma_px: 0.0 })
        .collect();
    let given = |file: &str, corners: Vec<Corner>| Entry {
        file: file.to_owned(),
        seen: Ok(Seen {
            size_px: [640, 480],
            exif: Exif::default(),
            pixels_hash: None,
            notes: Vec::new(),
            finding: Finding::Corners { corners, why: String::new() },
            other: Other::default(),
        }),
    };
    let part = corners[..7].to_vec();
    let entries =
        [given("a", corners.clone()), given("b", part), given("c", corners), given("d", Vec::new())];
    let a = assemble(&entries, &wanted(Some("4x3")));
    let states: Vec<_> = a.frames.iter().map(|f| f.state.name()).collect();
    assert_eq!(states, ["full", "partial", "full", "none"]);
    assert_eq!(a.frames[2].copy_of.as_deref(), Some("a"));
    assert_eq!(a.problem.as_ref().unwrap().observations.len(), 2);
    assert!(
        matches!(assemble(&entries, &wanted(None)).problem, Err(Error::Invalid(text)) if text.contains("--board"))
    );
}

#[test]
fn nothing_says_what_to_give() {
    let text = |entries: &[Entry]| assemble(entries, &wanted(None)).problem.unwrap_err().to_string();
    assert!(text(&[]).contains("no pictures"));
    assert!(text(&set()[4..]).contains("p/broken.png: cut short"));
    assert!(text(&set()[2..3]).contains("no corners"));
}

/// A grid of 4 x 3 markers seen from the front, as it is or from behind.
fn markers(mirrored: bool) -> Sighting {
    const CELL: usize = 12;
    let dictionary: Dictionary = "5x5_50".parse().unwrap();
    let n = usize::from(dictionary.cells());
    let light = |x: usize, y: usize| {
        // A marker of n + 2 cells, then a gap of three.
        let ([c, r], [i, j]) = ([x, y].map(|v| v / CELL / (n + 5)), [x, y].map(|v| v / CELL % (n + 5)));
        let white = match dictionary.code((4 * r + c) as u32) {
            Some(code) if c < 4 && r < 3 && i < n + 2 && j < n + 2 => {
                let inside = (1..=n).contains(&i) && (1..=n).contains(&j);
                inside && code >> (n * n - 1 - ((j - 1) * n + i - 1)) & 1 == 1
            }
            _ => true,
        };
        if white { 230 } else { 20 }
    };
    let (left, top, width) = (40, 40, 640);
    let place = |x: usize| (if mirrored { width - 1 - x } else { x }).checked_sub(left);
    let picture = Plane::from_fn(width, 480, |x, y| match (place(x), y.checked_sub(top)) {
        (Some(x), Some(y)) => light(x, y),
        _ => 230,
    });
    find(&Gray::U8(picture))
}

#[test]
fn mirrored_prints_are_named_whether_or_not_the_board_is() {
    for (board, mirrored) in [(None, true), (Some("aruco-grid:4x3:5x5_50"), true), (None, false)] {
        let mut entries: Vec<Entry> =
            (0..3).map(|i| entry(&format!("{i}.png"), [640, 480], None, i)).collect();
        for e in &mut entries {
            e.seen.as_mut().unwrap().other = Other { markers: Some(markers(mirrored)), circles: None };
        }
        let assembly = assemble(&entries, &wanted(board));
        for frame in &assembly.frames {
            assert_eq!(frame.why.contains("mirrored"), mirrored, "{board:?}: {}", frame.why);
            assert_eq!(frame.corners.len(), if mirrored { 0 } else { 48 }, "{board:?}");
        }
    }
}
