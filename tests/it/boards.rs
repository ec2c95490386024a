//! Printed boards are found again: what is on the sheet is photographed by a synthetic camera.

use std::sync::OnceLock;

use nalgebra::{Point3, Vector2, Vector3};
use straightedge::calib::{
    board::{Design, Kind, Page, Sheet},
    camera::{Camera, Model},
    circles, detect,
    image::{Gray, Plane},
    marker::{Sighting, board::MarkerBoard, find, guess::guess},
    observation::Corner,
    pose::Pose,
    target::Target,
};
use straightedge::job::{
    Other,
    assemble::{Entry, Finding, Seen, frame, target_of},
    photo::Exif,
};

/// Edge of the buckets that shapes of a page are sorted into, mm.
const BUCKET: f64 = 5.0;

/// What is printed where.
struct Printed {
    page: Page,
    columns: usize,
    /// Positions of rectangles, then discs, by bucket.
    buckets: Vec<Vec<usize>>,
}

impl Printed {
    fn new(sheet: &Sheet) -> Self {
        let page = Page::new(sheet).unwrap();
        let [columns, rows] = page.size.map(|s| (s / BUCKET) as usize + 1);
        let mut buckets = vec![Vec::new(); columns * rows];
        let discs = page.discs.iter().map(|[x, y, r]| [x - r, y - r, 2.0 * r, 2.0 * r]);
        for (i, [x, y, w, h]) in page.black.iter().copied().chain(discs).enumerate() {
            for r in (y / BUCKET) as usize..=((y + h) / BUCKET) as usize {
                for c in (x / BUCKET) as usize..=((x + w) / BUCKET) as usize {
                    buckets[r * columns + c].push(i);
                }
            }
        }
        Self { page, columns, buckets }
    }

    fn is_black(&self, x: f64, y: f64) -> bool {
        let [w, h] = self.page.size;
        if !(x >= 0.0 && y >= 0.0 && x < w && y < h) {
            return false;
        }
        let bucket = &self.buckets[(y / BUCKET) as usize * self.columns + (x / BUCKET) as usize];
        let n = self.page.black.len();
        bucket.iter().any(|i| {
            if let Some([bx, by, bw, bh]) = self.page.black.get(*i) {
                x >= *bx && x < bx + bw && y >= *by && y < by + bh
            } else {
                let [cx, cy, r] = self.page.discs[i - n];
                (x - cx).hypot(y - cy) < r
            }
        })
    }

    /// A photograph of the page.
    fn photographed(&self, camera: &Camera, camera_from_page: &Pose) -> Gray {
        const N: i32 = 3;
        let page_from_camera = camera_from_page.inverse();
        let origin = page_from_camera.translation;
        let rotation = *page_from_camera.rotation.matrix();
        let rays = rays(camera);
        let [w, h] = camera.size_px.map(|n| n as usize);
        Gray::U8(Plane::from_fn(w, h, |u, v| {
            let (i, j) = (u.min(w - 2), v.min(h - 2));
            let at = |x: usize, y: usize| rays[y * w + x];
            let (here, right, down) = (at(u, v), at(i + 1, j) - at(i, j), at(i, j + 1) - at(i, j));
            let off = |k: i32| (f64::from(k) + 0.5) / f64::from(N) - 0.5;
            let black = (0..N * N)
                .filter(|k| {
                    // Within a pixel the lens is linear.
                    let in_plane = here + right * off(k % N) + down * off(k / N);
                    let ray: Vector3<f64> = rotation * in_plane.push(1.0);
                    let t = -origin.z / ray.z;
                    self.is_black(origin.x + t * ray.x, origin.y + t * ray.y)
                })
                .count();
            (220.0 - 190.0 * black as f64 / f64::from(N * N)).round() as u8
        }))
    }
}

/// What the middles of the pixels show, in the plane z = 1, row by row.
fn rays(camera: &Camera) -> &'static [Vector2<f64>] {
    static RAYS: OnceLock<Vec<Vector2<f64>>> = OnceLock::new();
    RAYS.get_or_init(|| {
        let [w, h] = camera.size_px;
        let pixels = (0..h).flat_map(|v| (0..w).map(move |u| Vector2::new(f64::from(u), f64::from(v))));
        pixels.map(|px| camera.unproject(&px).unwrap()).map(|ray| ray.xy() / ray.z).collect()
    })
}

/// The camera of all pictures here.
fn camera() -> Camera {
    let params = vec![1300.0, 1300.0, 640.0, 470.0, -0.12, 0.03, 5e-4, -3e-4, 0.0];
    Camera::new(Model::Brown5, [1280, 960], params).unwrap()
}

/// The page in the middle of the picture, turned.
fn pose(page: &Page, degrees: [f64; 3]) -> Pose {
    let middle = Vector3::new(page.size[0] / 2.0, page.size[1] / 2.0, 0.0);
    let turn = Pose::from_euler_deg(degrees, Vector3::zeros());
    let far = 1.25 * page.size[0].max(page.size[1]);
    Pose { translation: Vector3::new(0.0, 0.0, far) - turn.rotation * middle, ..turn }
}

/// Where point 0 of the board frame lies on the page, mm.
fn origin(page: &Page, target: &Target) -> [f64; 2] {
    match target {
        Target::Checkerboard { square, .. } => [page.black[0][0] + square, page.black[0][1] + square],
        Target::Markers { board, scale } => {
            let first = board.ink().unwrap()[0];
            [page.black[0][0] - scale * first[0], page.black[0][1] - scale * first[1]]
        }
        Target::Circles { .. } => [page.discs[0][0], page.discs[0][1]],
        Target::Points { .. } => unreachable!("no sheet is printed of points"),
    }
}

const TURNS: [[f64; 3]; 2] = [[18.0, -14.0, 7.0], [-16.0, 20.0, -4.0]];

fn same_board(found: &MarkerBoard, printed: &MarkerBoard) -> bool {
    match (found, printed) {
        (MarkerBoard::Charuco(a), MarkerBoard::Charuco(b)) => {
            let layout = a.legacy == b.legacy || b.rows % 2 == 1;
            let share = (a.marker / a.square - b.marker).abs() < 0.02;
            layout && share && (a.columns, a.rows, a.first_id) == (b.columns, b.rows, b.first_id)
        }
        (MarkerBoard::AprilGrid(a), MarkerBoard::AprilGrid(b)) => {
            (a.spacing - b.spacing).abs() < 0.02
                && (a.columns, a.rows, a.border, a.first_id) == (b.columns, b.rows, b.border, b.first_id)
        }
        (MarkerBoard::ArucoGrid(a), MarkerBoard::ArucoGrid(b)) => {
            (a.gap / a.marker - b.gap).abs() < 0.02
                && (a.columns, a.rows, a.first_id) == (b.columns, b.rows, b.first_id)
        }
        _ => false,
    }
}

/// Photographs of a board with squares of 25 mm, from several sides.
pub(super) fn photographs(board: &str) -> Vec<Plane<u8>> {
    let sheet = Sheet { design: board.parse().unwrap(), square: "25mm".parse().unwrap() };
    let printed = Printed::new(&sheet);
    let turns = [
        [18.0, -14.0, 7.0],
        [-16.0, 20.0, -4.0],
        [25.0, 22.0, 40.0],
        [-24.0, -20.0, -35.0],
        [2.0, 30.0, 90.0],
        [30.0, 0.0, 12.0],
    ];
    let pictures = turns.map(|turn| printed.photographed(&camera(), &pose(&printed.page, turn)));
    let grey = |picture: Gray| match picture {
        Gray::U8(plane) => plane,
        Gray::U16(_) => panic!("photographs have 8 bits"),
    };
    pictures.map(grey).to_vec()
}

/// Photographs a sheet twice and finds it; answers the largest distance of a corner from its true place, px.
fn found_again(sheet: &Sheet) -> f64 {
    let printed = Printed::new(sheet);
    let target = sheet.target().unwrap();
    let [x0, y0] = origin(&printed.page, &target);
    let camera = camera();
    let poses = TURNS.map(|turn| pose(&printed.page, turn));
    let pictures = poses.map(|pose| printed.photographed(&camera, &pose));
    let kind = sheet.design.kind;
    let seen: Vec<Vec<Corner>> = match &target {
        Target::Checkerboard { size, .. } => {
            let grids =
                pictures.each_ref().map(|p| detect::detect(p, &detect::Options::default()).grid.unwrap());
            assert_eq!(detect::board_of(&grids.iter().collect::<Vec<_>>()).unwrap().size, *size);
            grids.iter().map(|g| g.assign(*size, &[]).unwrap().corners).collect()
        }
        Target::Markers { board, .. } => {
            let sightings: Vec<Sighting> = pictures.iter().map(find).collect();
            let guessed = guess(&sightings).board.unwrap();
            assert!(same_board(&guessed, board), "{kind}: {guessed:?} of {board:?}");
            sightings.iter().map(|s| guessed.locate(s).corners).collect()
        }
        Target::Circles { board, .. } => {
            let grids = pictures.each_ref().map(|p| circles::detect(p).grid.unwrap());
            assert_eq!(circles::board_of(&grids.iter().collect::<Vec<_>>()).unwrap().board, *board);
            grids.iter().map(|g| g.assign(*board).unwrap().corners).collect()
        }
        Target::Points { .. } => unreachable!("no sheet is printed of points"),
    };
    let mut worst = 0.0f64;
    for (corners, pose) in seen.iter().zip(&poses) {
        assert_eq!(corners.len(), target.len(), "{kind}");
        for corner in corners {
            let p = target.point_in_board(corner.index).unwrap();
            let truth = camera.project(&pose.apply(&Point3::new(p.x + x0, p.y + y0, 0.0))).unwrap();
            worst = worst.max((truth - corner.px).norm());
        }
    }
    println!("{kind} {}: {} corners twice, largest error {worst:.3} px", sheet.design.size, target.len());
    worst
}

#[test]
fn every_kind_of_board_is_found_again_with_its_layout_and_identities() {
    for (kind, size, square) in [
        (Kind::Checkerboard, "9x6", "25mm"),
        (Kind::Charuco, "11x8", "24mm"),
        (Kind::AprilGrid, "6x5", "30mm"),
        (Kind::ArucoGrid, "7x5", "27mm"),
        (Kind::Circles, "9x6", "26mm"),
        (Kind::AsymmetricCircles, "4x11", "17mm"),
    ] {
        let sheet = Sheet::new(kind, size.parse().unwrap(), square.parse().unwrap());
        let worst = found_again(&sheet);
        // Pixels are the mean of nine points; the middles of circles are not corrected for perspective here.
        assert!(worst < 0.5, "{kind}: {worst} px");
    }
}

#[test]
fn dictionaries_first_ids_and_the_old_layout_are_printed_as_named() {
    let sheet = |words: &str| Sheet { design: words.parse().unwrap(), square: "30mm".parse().unwrap() };
    assert!(found_again(&sheet("charuco:8x6:4x4_100:marker=0.7:legacy")) < 0.5);
    let base = sheet("charuco:8x6");
    let design = Design { dictionary: Some("16h5".parse().unwrap()), first_id: 8, ..base.design };
    let many = Sheet { design, ..base };
    let error = Page::new(&many).unwrap_err().to_string();
    assert!(error.contains("needs the ids 8 to 31, the dictionary 16h5 ends at 29"), "{error}");
}

/// Photographs of a sheet as pictures that were looked at.
fn looked_at(sheet: &Sheet) -> Vec<Entry> {
    let printed = Printed::new(sheet);
    let photographs = TURNS.map(|turn| printed.photographed(&camera(), &pose(&printed.page, turn)));
    let entry = |(i, picture): (usize, &Gray)| {
        let detection = detect::detect(picture, &detect::Options::default());
        let other = Other::beside(picture, &detection);
        let seen = Seen {
            size_px: picture.size().map(|n| n as u32),
            exif: Exif::default(),
            pixels_hash: None,
            notes: Vec::new(),
            finding: Finding::Grid(detection),
            other,
        };
        Entry { file: format!("{i}.png"), seen: Ok(seen) }
    };
    photographs.iter().enumerate().map(entry).collect()
}

#[test]
fn a_board_that_is_given_is_taken_and_what_the_pictures_contradict_is_told() {
    let sheet = |words: &str| Sheet { design: words.parse().unwrap(), square: "25mm".parse().unwrap() };
    let charuco = looked_at(&sheet("charuco:8x6:4x4_100:marker=0.7"));
    let aruco = looked_at(&sheet("aruco-grid:7x5:5x5_250:gap=0.5"));
    let circles = looked_at(&sheet("circles:9x6:diameter=0.5"));
    for (entries, given, taken, says) in [
        (&charuco, "charuco:8x6", "4x4_50, markers of 0.70 squares", ""),
        (&charuco, "charuco:8x6:4x4_250:marker=0.7", "4x4_250, markers of 0.70", ""),
        (&charuco, "charuco:8x6:5x5_50", "5x5_50", "show markers of 4x4_50, not of 5x5_50"),
        (&charuco, "charuco:8x6:marker=0.5", "markers of 0.50", "Edge of a marker measures 0.70"),
        (&charuco, "charuco:6x8", "6x8", "show a ChArUco board of 8x6 squares, not a ChArUco board of 6x8"),
        (&aruco, "aruco-grid:7x5", "5x5_50, gaps of 0.50 markers", ""),
        (&aruco, "charuco:7x5", "ChArUco", "show an ArUco grid of 7x5 markers"),
        (&circles, "circles:9x6", "symmetric 9x6", ""),
    ] {
        let mut warnings = Vec::new();
        let all: Vec<&Entry> = entries.iter().collect();
        let design: Design = given.parse().unwrap();
        let target = target_of(&all, Some(&design), 30.0, &mut warnings).unwrap().unwrap();
        assert!(target.words().contains(taken), "{given}: {}", target.words());
        assert_eq!(warnings.len(), usize::from(!says.is_empty()), "{given}: {warnings:?}");
        assert!(warnings.iter().all(|w| w.text.contains(says)), "{given}: {warnings:?}");
        if says.is_empty() {
            let found: Vec<_> = all.iter().map(|e| frame(e, Some(&target), &[]).corners.len()).collect();
            assert_eq!(found, [target.len(); 2], "{given}");
        } else {
            let frames = all.iter().map(|e| frame(e, Some(&target), &[]));
            assert!(frames.filter(|f| f.corners.len() == target.len()).count() == 0, "{given}");
        }
    }
    let Some(Target::Circles { radius, .. }) = target_of(
        &circles.iter().collect::<Vec<_>>(),
        Some(&"circles:9x6".parse().unwrap()),
        30.0,
        &mut Vec::new(),
    )
    .unwrap() else {
        panic!("no circles")
    };
    assert!((radius - 7.5).abs() < 0.2, "{radius}");
}
